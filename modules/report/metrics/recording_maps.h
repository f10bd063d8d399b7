#pragma once

// Which of an agent's maps were made from its recording. A continued journal has maps of earlier
// sessions too, of the same agent but of other recordings. Their clocks may overlap, because
// rendered recordings all begin at one time and a phone's clock at its boot. So a trajectory, and a
// comparison with ground truth, is of the maps of one recording alone.

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "report/metrics/report_groups.h"
#include "report/report.h"

namespace pangea {

// Time from a map's first keyframe to its last, sensor clock.
struct MapSpan {
  int64_t begin = 0, end = 0;
};
using MapSpans = std::map<MapId, MapSpan>;
MapSpans SpansOf(const std::vector<FinalGroup>& groups);

// Those of `maps` that overlap none of the others. An odometry opens one map after the other, so
// maps of one agent that overlap are of different recordings.
std::set<MapId> WithoutOverlap(const std::set<MapId>& maps, const MapSpans& spans);

// The agent's maps in the group, as one recording can have made them: those without overlap
// together, each other one alone; the largest first.
std::vector<std::set<MapId>> TrajectoriesOf(const FinalGroup& group, int32_t agent_id,
                                            const MapSpans& spans);

// Those of the agent's `maps` that were made from its recording: as `run` knows; else those that
// overlap no other one. Appends a note about the rest.
std::set<MapId> MapsOfRecording(const AgentRun& run, const std::set<MapId>& maps,
                                const MapSpans& spans, std::vector<std::string>* notes);

}  // namespace pangea

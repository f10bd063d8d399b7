#include "report/metrics/recording_maps.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>

namespace pangea {
namespace {

// An odometry that is started again repeats some images.
constexpr int64_t kRepeated_us = 1'000'000;

bool Overlap(const MapSpan& a, const MapSpan& b) {
  return std::min(a.end, b.end) - std::max(a.begin, b.begin) > kRepeated_us;
}

}  // namespace

MapSpans SpansOf(const std::vector<FinalGroup>& groups) {
  MapSpans spans;
  for (const FinalGroup& group : groups) {
    for (const FinalKeyframe& keyframe : group.keyframes) {
      MapSpan& span =
          spans.try_emplace(keyframe.id.map, MapSpan{keyframe.utime, keyframe.utime}).first->second;
      span.begin = std::min(span.begin, keyframe.utime);
      span.end = std::max(span.end, keyframe.utime);
    }
  }
  return spans;
}

std::set<MapId> WithoutOverlap(const std::set<MapId>& maps, const MapSpans& spans) {
  std::set<MapId> alone = maps;
  std::erase_if(alone, [&](const MapId& map) {
    return std::ranges::any_of(maps, [&](const MapId& other) {
      const auto a = spans.find(map), b = spans.find(other);
      return other != map && a != spans.end() && b != spans.end() && Overlap(a->second, b->second);
    });
  });
  return alone;
}

std::vector<std::set<MapId>> TrajectoriesOf(const FinalGroup& group, int32_t agent_id,
                                            const MapSpans& spans) {
  std::set<MapId> maps(group.maps.begin(), group.maps.end());
  std::erase_if(maps, [agent_id](const MapId& map) { return map.agent_id != agent_id; });
  const std::set<MapId> together = WithoutOverlap(maps, spans);
  std::vector<std::set<MapId>> trajectories;
  if (!together.empty()) {
    trajectories.push_back(together);
  }
  for (const MapId& map : maps) {
    if (!together.contains(map)) {
      trajectories.push_back({map});
    }
  }
  std::ranges::stable_sort(trajectories, std::greater<>(),
                           [&group](const auto& of) { return group.CountOf(of); });
  return trajectories;
}

std::set<MapId> MapsOfRecording(const AgentRun& run, const std::set<MapId>& maps,
                                const MapSpans& spans, std::vector<std::string>* notes) {
  std::set<MapId> of_recording = maps;
  if (run.maps) {
    std::erase_if(of_recording, [&run](const MapId& map) { return !run.maps->contains(map); });
  } else {
    of_recording = WithoutOverlap(maps, spans);
  }
  std::vector<std::string> others;
  for (const MapId& map : maps) {
    if (!of_recording.contains(map)) {
      others.push_back(ToString(map));
    }
  }
  if (!others.empty()) {
    notes->push_back(fmt::format(
        "agent {}: {} of its {} maps, {}, {}; not compared with the agent's ground truth", run.id,
        others.size(), maps.size(), fmt::join(others, ", "),
        run.maps ? "are of other sessions"
                 : "overlap in time, so they are of different recordings, and which of them is of "
                   "the known one is not recorded"));
  }
  return of_recording;
}

}  // namespace pangea

#pragma once

// map.ply and the two pictures.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "eval/plot.h"
#include "report/metrics/report_metrics.h"

namespace pangea::session {

struct ColouredPoint {
  Eigen::Vector3d p_map;
  std::array<uint8_t, 3> rgb;  // its agent's
};

// The group's map points in its map frame; a landmark seen by several keyframes of a map counts
// once, from where its depth is known best.
std::vector<ColouredPoint> MapPoints(const CapturedSession& session, const ReportMetrics& metrics,
                                     const FinalGroup& group);
// The same as ASCII PLY.
std::string MapPly(const CapturedSession& session, const ReportMetrics& metrics,
                   const FinalGroup& group);

struct Picture {
  std::string file;  // name in the output folder
  Plot plot;
};

// One top view of everything ground truth places; each further group in its own.
std::vector<Picture> Pictures(const ReportMetrics& metrics);

}  // namespace pangea::session

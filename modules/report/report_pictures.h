#pragma once

// map.ply and the two pictures.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "eval/plot.h"
#include "report/metrics/report_metrics.h"

namespace pangea {

struct ColouredPoint {
  Eigen::Vector3d p_map;
  std::array<uint8_t, 3> rgb;  // its agent's
};

// The group's map points in its map frame; a landmark seen by several keyframes of a map appears
// once, from the keyframe with its most certain depth.
std::vector<ColouredPoint> MapPoints(const CapturedSession& session, const ReportMetrics& metrics,
                                     const FinalGroup& group);
// The map points as ASCII PLY.
std::string MapPly(const CapturedSession& session, const ReportMetrics& metrics,
                   const FinalGroup& group);

struct Picture {
  std::string file;  // name in the output folder
  Plot plot;
};

// One top view of all groups with ground truth; each other group has its own.
std::vector<Picture> Pictures(const ReportMetrics& metrics);

}  // namespace pangea

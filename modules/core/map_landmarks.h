#pragma once

// Landmarks of the fused map, as the server sends them to one agent.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/ids.h"
#include "core/keyframe.h"

namespace pangea {

struct MapLandmark {
  int source = 0;           // index into MapLandmarks::sources
  int32_t landmark_id = 0;  // unique in the source's map
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  // Standard deviations along the ray from the source's camera and across that ray, metres.
  double sigma_along_m = 0;
  double sigma_across_m = 0;
  Descriptor descriptor{};  // from the source's image
};

struct MapLandmarks {
  // A keyframe of the group. All landmarks from one source share the error of its pose in the map.
  struct Source {
    KeyframeId keyframe;
    Eigen::Vector3d p_map_cam = Eigen::Vector3d::Zero();  // position of its camera
  };

  MapId map;             // the agent's map that they are sent to
  MapId group;           // the map whose odom frame is the map frame
  int64_t revision = 0;  // of the group's MapState
  std::vector<Source> sources;
  std::vector<MapLandmark> landmarks;
};

}  // namespace pangea

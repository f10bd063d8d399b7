#pragma once

// Compares the positions at which agents show anchors with ground truth.
//
// The true position of an anchor follows from its placement by agent i at an image:
//   p_truth = T_truth_body_i * T_odom_body_i^-1 * p_odom
// with p_odom the position that agent i received first, and T_odom_body_i the pose used for the
// placement (so that the tapped pixel's ray goes through the anchor). Agent j shows the anchor at
// p_odom_shown, which in the ground truth's frame is
//   T_truth_body_j * T_odom_body_j^-1 * p_odom_shown
// and the distance between the two is the error. All ground truths are in one frame.

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/camera_model.h"
#include "report/anchor_track.h"
#include "report/report.h"
#include "report/report_log.h"

namespace pangea {

// An anchor in one image.
struct AnchorView {
  int32_t agent = 0;
  int64_t utime = 0;    // of the image
  Rigid3 T_cam_anchor;  // as shown
  // in the camera; empty at the placement, which defines the truth
  std::optional<Eigen::Vector3d> p_truth;
};

// Errors against ground truth, metres (the jump needs none); empty if unknown.
struct AnchorAtAgent {
  int32_t agent = 0;
  std::optional<double> error_m;            // median, from kAnchorSettled_us after the fusion on
  std::optional<double> error_px;           // the same in pixels, for an image 640 wide, if in view
  std::optional<double> largest_jump_m;     // of the shown position, in its odom frame, per image
  std::optional<double> error_at_fusion_m;  // when first shown after the fusion
  std::optional<double> error_10s_m;        // first error from kAnchorSettled_us on
  std::optional<double> error_end_m;
  std::optional<double> error_max_m;        // from then on
  std::optional<double> error_unblended_m;  // like error_m, for the pose in ANCHOR_k
  std::string reason;                       // why there is no error_m; else empty
  std::optional<AnchorView> view;           // from kAnchorSettled_us on: furthest inside the image
};

struct AnchorMetrics {
  std::optional<AnchorId> id;  // empty: never requested
  std::string name;
  int32_t made_by = 0;  // 0: a tool on the server
  bool placed = false;  // an agent received its pose, or the server published it
  std::optional<AnchorView> placing;
  std::vector<AnchorAtAgent> agents;  // other agents in its group at the end, ascending
};

inline constexpr int64_t kAnchorSettled_us = 10'000'000;

// Distance, in pixels, of a point from the nearest image border; empty if it is not in the image.
// `p_cam`: in the camera frame.
std::optional<double> Inside(const CameraModel& camera, const Eigen::Vector3d& p_cam);

// The data of one agent.
struct AnchorViewer {
  int32_t agent = 0;
  const AnchorTrack* track = nullptr;
  const std::map<MapId, Trajectory>* odometry = nullptr;  // T_odom_body
  const Trajectory* ground_truth = nullptr;
  const std::set<MapId>* recording_maps = nullptr;  // those with this ground truth
};

// Metrics of all anchors, ascending by id; last come those of `wanted` that were never requested.
std::vector<AnchorMetrics> AnchorsOf(const CapturedSession& session,
                                     const std::vector<AnchorViewer>& viewers,
                                     const std::vector<WantedAnchor>& wanted);

}  // namespace pangea

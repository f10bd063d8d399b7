#pragma once

// Where agents show anchors, against where ground truth has them.
//
// An anchor's true place follows from its placing by agent i at an image:
//   p_truth = T_truth_body_i * T_odom_body_i^-1 * p_odom
// with p_odom where agent i first heard that it is, and T_odom_body_i the pose that it was placed
// by (so that a tap on a pixel is on the ray through that pixel). Agent j shows it at p_odom_shown,
// so at
//   T_truth_body_j * T_odom_body_j^-1 * p_odom_shown
// and the distance of the two is the error. All ground truths are in one frame.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/camera_model.h"
#include "report/anchor_track.h"
#include "report/report.h"
#include "report/report_log.h"

namespace pangea::session {

// An anchor in one image.
struct AnchorView {
  int32_t agent = 0;
  int64_t utime = 0;                       // of the image
  Rigid3 T_cam_anchor;                     // as it is shown
  std::optional<Eigen::Vector3d> p_truth;  // in the camera; none at its placing, where it is true
};

// All by ground truth, metres, but for the jump; none where they are not known.
struct AnchorAtAgent {
  int32_t agent = 0;
  std::optional<double> error_m;   // median from kAnchorSettled_us after the fusion on
  std::optional<double> error_px;  // the same, at 640 wide, where the true place is in the image
  std::optional<double> largest_jump_m;     // shown, in its odom frame, from a frame to the next
  std::optional<double> error_at_fusion_m;  // as first shown after it
  std::optional<double> error_10s_m;        // the first from then on
  std::optional<double> error_end_m;
  std::optional<double> error_max_m;        // from then on
  std::optional<double> error_unblended_m;  // as error_m, of what ANCHOR_k says
  std::string reason;                       // why there is no error_m; empty where there is
  std::optional<AnchorView> view;           // from then on, furthest inside the image
};

struct AnchorMetrics {
  std::optional<AnchorId> id;  // none: it was never requested
  std::string name;
  int32_t made_by = 0;  // 0: a tool on the server
  bool placed = false;  // an agent heard where it is, or the server said it
  std::optional<AnchorView> placing;
  std::vector<AnchorAtAgent> agents;  // the others of its group at the end, ascending
};

inline constexpr int64_t kAnchorSettled_us = 10'000'000;

// Pixels from the nearest border of a point in the camera frame; none where it is not in the image.
std::optional<double> Inside(const CameraModel& camera, const Eigen::Vector3d& p_cam);

// What is known of one agent.
struct AnchorViewer {
  int32_t agent = 0;
  const AnchorTrack* track = nullptr;
  const std::map<MapId, Trajectory>* odometry = nullptr;  // T_odom_body
  const Trajectory* ground_truth = nullptr;
};

// Ascending by id; those of `wanted` that were never requested at the end.
std::vector<AnchorMetrics> AnchorsOf(const CapturedSession& session,
                                     const std::vector<AnchorViewer>& viewers,
                                     const std::vector<WantedAnchor>& wanted);

}  // namespace pangea::session

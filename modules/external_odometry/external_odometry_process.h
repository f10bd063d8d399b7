#pragma once

// Makes an agent of an external odometry: images and their poses in, an agent's messages out.
//   Out: POSE_k at every image, KEYFRAME_k once each, STATUS_external_odometry_k at 1 Hz.
//   In: CORRECTION_k; HAVE, RESEND_REQUEST (with answers on AGAIN_<requester>) as in
//   reliable_keyframe_publisher.h
//
// After it was lost, such an odometry may continue elsewhere, or correct itself by a jump. A jump
// is not motion, so it begins a new map.

#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>

#include "bus/node.h"
#include "bus/process.h"
#include "bus/retransmission/reliable_keyframe_publisher.h"
#include "external_odometry/keyframe_maker.h"
#include "vio/live/shown_pose.h"

namespace pangea {

class ExternalOdometryProcess : public Process {
 public:
  static constexpr size_t kKeptKeyframes = 200;
  // If the odometry is lost for longer, the next pose begins a new map.
  static constexpr int64_t kMaxLost_us = 500'000;
  // A pose is a jump if it deviates from a constant velocity by more than kMaxStep_m +
  // kMaxAcceleration * dt^2, or if it rotates faster than kMaxRotation. The first two poses of a
  // map have no velocity before them: there a jump is faster than kMaxSpeed.
  static constexpr double kMaxStep_m = 0.1;
  static constexpr double kMaxAcceleration = 20;  // m/s^2
  static constexpr double kMaxRotation = 10;      // rad/s
  static constexpr double kMaxSpeed = 50;         // m/s

  // `open_map` returns the opened_utime of each new map, ascending. `now_utime`: wall clock.
  ExternalOdometryProcess(Bus& bus, int32_t agent_id, const CameraModel& camera,
                          std::function<int64_t()> open_map, int64_t now_utime);

  // `image`: 8-bit grey; refused unless its `utime` is after that of the image before.
  // `T_odom_body`: the z axis of odom points up; empty, or not finite, while the odometry is lost.
  // Returns the keyframe if the image became one; it is already published.
  std::optional<Keyframe> AddImage(int64_t utime, const cv::Mat& image,
                                   const std::optional<Rigid3>& T_odom_body);
  // The next pose begins a new map; its clock may start again.
  void StartAnew() {
    maker_.reset();
    last_.reset();
    last_image_utime_.reset();
  }

  void Tick(int64_t now_utime) override;

  const ReliableKeyframePublisher& publisher() const { return publisher_; }
  Node& node() { return node_; }

 private:
  struct Step {
    int64_t utime = 0;
    Rigid3 T_odom_body;
    Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();
    bool has_velocity = false;  // false: the first pose of a map
  };
  bool GoesOn(const Step& now) const;
  void Publish(const Step& now, bool tracking);

  const int32_t agent_id_;
  const CameraModel camera_;
  const std::function<int64_t()> open_map_;
  Node node_;
  ReliableKeyframePublisher publisher_;
  vio::ShownPose shown_;
  MapId map_;
  std::optional<KeyframeMaker> maker_;  // for this map; empty: the next pose begins one
  std::optional<Step> last_;            // the last pose of this map
  std::optional<int64_t> last_image_utime_;
  bool lost_ = false;  // since last_
};

}  // namespace pangea

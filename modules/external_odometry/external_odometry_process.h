#pragma once

// An odometry that is not ours as an agent on a bus: images and the poses it has for them in.
//   POSE_k at every image, KEYFRAME_k once each, STATUS_external_odometry_k at 1 Hz out;
//   CORRECTION_k in; HAVE, RESEND_REQUEST in and AGAIN_<requester> out as in
//   reliable_keyframe_publisher.h
//
// Such an odometry may find itself again elsewhere after it was lost, or correct itself by a jump.
// Neither is motion: a new map begins.

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
  // Lost for longer, what comes is a new map.
  static constexpr int64_t kMaxLost_us = 500'000;
  // What a hand, or a drone, does not do: away from an even motion by more than this, and this over
  // the square of the time; or a rotation that is faster.
  static constexpr double kMaxStep_m = 0.1;
  static constexpr double kMaxAcceleration = 20;  // m/s^2
  static constexpr double kMaxRotation = 10;      // rad/s

  // `open_map` gives each map's opened_utime, growing; `now_utime`: wall clock.
  ExternalOdometryProcess(Bus& bus, int32_t agent_id, const CameraModel& camera,
                          std::function<int64_t()> open_map, int64_t now_utime);

  // 8-bit grey, in time order. `T_odom_body`: z up; nothing while the odometry is lost. The
  // keyframe that it became, if it did: published.
  std::optional<Keyframe> AddImage(int64_t utime, const cv::Mat& image,
                                   const std::optional<Rigid3>& T_odom_body);
  // What comes next is a new map.
  void StartAnew() { maker_.reset(); }

  void Tick(int64_t now_utime) override;

  const ReliableKeyframePublisher& publisher() const { return publisher_; }
  Node& node() { return node_; }

 private:
  struct Step {
    int64_t utime = 0;
    Rigid3 T_odom_body;
    Eigen::Vector3d v_odom_body = Eigen::Vector3d::Zero();
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
  std::optional<KeyframeMaker> maker_;  // of this map; none: the next pose opens one
  std::optional<Step> last_;            // of this map
  bool lost_ = false;                   // since then
  int64_t next_status_utime_ = 0;
};

}  // namespace pangea

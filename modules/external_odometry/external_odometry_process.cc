#include "external_odometry/external_odometry_process.h"

#include <fmt/format.h>

#include <utility>

#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/pose_t.hpp"

namespace pangea {

ExternalOdometryProcess::ExternalOdometryProcess(Bus& bus, int32_t agent_id,
                                                 const CameraModel& camera,
                                                 std::function<int64_t()> open_map,
                                                 int64_t now_utime)
    : agent_id_(agent_id),
      camera_(camera),
      open_map_(std::move(open_map)),
      node_(bus, fmt::format("external_odometry_{}", agent_id)),
      publisher_(node_, agent_id, kKeptKeyframes, now_utime) {
  node_.Listen<correction_t>(channels::Correction(agent_id), [this](const Correction& correction) {
    node_.Count("corrections", shown_.Correct(correction) ? 1 : 0);
  });
}

// Whether the pose continues the motion of the last one. A time without images is not a loss of
// tracking: the odometry may have processed more images than it passes on.
bool ExternalOdometryProcess::GoesOn(const Step& now) const {
  const double dt = 1e-6 * static_cast<double>(now.utime - last_->utime);
  const Eigen::Vector3d off = now.T_odom_body.t - last_->T_odom_body.t - last_->v_odom_body * dt;
  const double angle = LogSo3(last_->T_odom_body.q.conjugate() * now.T_odom_body.q).norm();
  const bool long_lost = lost_ && now.utime - last_->utime > kMaxLost_us;
  const double reach_m = last_->has_velocity ? kMaxAcceleration * dt * dt : kMaxSpeed * dt;
  return !long_lost && off.norm() <= kMaxStep_m + reach_m && angle <= kMaxRotation * dt;
}

std::optional<Keyframe> ExternalOdometryProcess::AddImage(
    int64_t utime, const cv::Mat& image, const std::optional<Rigid3>& T_odom_body) {
  if (utime <= last_image_utime_) {  // a velocity needs two times
    node_.Refuse("image: its time does not go forward");
    return std::nullopt;
  }
  last_image_utime_ = utime;
  node_.Count("frames");
  const bool has_pose =
      T_odom_body && T_odom_body->t.allFinite() && T_odom_body->q.coeffs().allFinite();
  Step now{utime, has_pose ? *T_odom_body : Rigid3{}, Eigen::Vector3d::Zero()};
  if (!has_pose) {
    lost_ = true;
    Publish(now, /*tracking=*/false);
    return std::nullopt;
  }
  if (maker_ && last_ && !GoesOn(now)) {
    node_.Count("lost");
    maker_.reset();
  }
  if (!maker_) {
    map_ = {agent_id_, open_map_()};
    maker_.emplace(map_, camera_, KeyframeMakerOptions{});
    shown_.Reset(map_);
    node_.Count("maps");
  } else if (last_) {
    now.v_odom_body = (now.T_odom_body.t - last_->T_odom_body.t) /
                      (1e-6 * static_cast<double>(now.utime - last_->utime));
    now.has_velocity = true;
  }
  last_ = now;
  lost_ = false;
  std::optional<Keyframe> keyframe = maker_->Add(utime, image, *T_odom_body);
  Publish(now, /*tracking=*/true);
  if (keyframe) {
    publisher_.Publish(keyframe->id, EncodeMessage(ToMessage(*keyframe)));
  }
  return keyframe;
}

void ExternalOdometryProcess::Publish(const Step& now, bool tracking) {
  pose_t message{};
  message.utime = now.utime;
  message.state = tracking ? pose_t::STATE_TRACKING : pose_t::STATE_LOST;
  message.reason = tracking ? "" : "the device's own odometry is lost";
  message.map = ToMessage(map_);
  message.T_odom_body = ToMessage(now.T_odom_body);
  message.v_odom_body = ToMessage(now.v_odom_body);
  message.T_map_body =
      ToMessage(tracking ? shown_.Show(now.utime, now.T_odom_body) : now.T_odom_body);
  message.group_revision = shown_.revision();
  message.num_tracked = tracking ? maker_->num_tracked() : 0;
  node_.Set("tracked", message.num_tracked);
  node_.Publish(channels::Pose(agent_id_), message);
}

void ExternalOdometryProcess::Tick(int64_t now_utime) {
  publisher_.Tick(now_utime);
  if (node_.StatusIsDue(now_utime)) {
    node_.PublishStatus(now_utime, publisher_.Unacknowledged(), "poses of another odometry");
  }
}

}  // namespace pangea

#include "vio/keyframes/keyframe_edges.h"

#include <cmath>

#include "vio/keyframes/keyframe_finisher.h"

namespace pangea::vio {
namespace {

// Time at which a frame's image was taken, on the IMU's clock.
int64_t TakenAt(const WindowState& state, const WindowFrame& frame) {
  return frame.utime + std::llround(1e6 * state.TimeOffsetOf(frame)) +
         std::llround(1e6 * frame.stamp_error_s);
}

// T_odom_body at that time, as the window has it now.
Rigid3 PoseOf(const WindowState& state, int index) {
  return state.PoseAhead(index, state.Ahead(index, 0));
}

}  // namespace

FinishedKeyframe KeyframeEdges::Finish(WindowState& state, const Eigen::MatrixXd& P,
                                       const TrackHistory& history, const ImuBuffer& imu,
                                       int index) {
  FinishedKeyframe keyframe = FinishKeyframe(state, P, history, index);
  const auto from = last_ ? state.Find(last_->utime) : std::nullopt;
  if (from) {
    keyframe.edge = FinishedKeyframe::Edge{PoseOf(state, *from).Inverse() * keyframe.T_odom_body,
                                           RelativeCovariance(state, P, *from, index)};
    ScaledPreintegration span =
        imu.Integrate(TakenAt(state, state.frames[*from]), TakenAt(state, state.frames[index]),
                      state.imu_intrinsics, last_->gyro_bias, last_->accel_bias);
    if (span.measured.duration_s > 0 && !ContradictedWithin(last_->utime, keyframe.utime)) {
      span.measured.covariance.diagonal().array() += 1e-14;
      keyframe.preintegration = span.measured;
    }
  }
  state.frames[index].is_published = true;
  contradicted_utimes_.erase(contradicted_utimes_.begin(),
                             contradicted_utimes_.upper_bound(keyframe.utime));
  last_ = keyframe;
  return keyframe;
}

void KeyframeEdges::NoteContradicted(const WindowProblem& problem) {
  for (int to = 1; to <= problem.state.Newest(); ++to) {
    if (problem.imu_factors[to] && problem.imu_factors[to]->contradicted) {
      contradicted_utimes_.insert(problem.state.frames[to].utime);
    }
  }
}

std::optional<int64_t> KeyframeEdges::last_utime() const {
  return last_ ? std::optional(last_->utime) : std::nullopt;
}

bool KeyframeEdges::ContradictedWithin(int64_t after_utime, int64_t to_utime) const {
  const auto first = contradicted_utimes_.upper_bound(after_utime);
  return first != contradicted_utimes_.end() && *first <= to_utime;
}

}  // namespace pangea::vio

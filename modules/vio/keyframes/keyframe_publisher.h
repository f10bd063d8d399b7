#pragma once

// Keyframes in the order they are published, each with its edge from the one before and the
// inertial measurement of the same span.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <set>

#include "vio/imu/imu_buffer.h"
#include "vio/keyframes/track_history.h"
#include "vio/window/estimator.h"
#include "vio/window/window_problem.h"

namespace pangea::vio {

class KeyframePublisher {
 public:
  // Frame `index` of the window, whose covariance is P.
  FinishedKeyframe Publish(WindowState& state, const Eigen::MatrixXd& P,
                           const TrackHistory& history, const ImuBuffer& imu, int index);
  // Samples that the images contradict are no measurement for an edge.
  void NoteContradicted(const WindowProblem& problem);
  // Of the keyframe published last.
  std::optional<int64_t> last_utime() const;

 private:
  bool ContradictedWithin(int64_t after_utime, int64_t to_utime) const;

  std::optional<FinishedKeyframe> last_;
  Matrix6d last_covariance_ = Matrix6d::Zero();  // of its pose, when it was published
  std::set<int64_t> contradicted_utimes_;        // ends of such IMU factors since then
};

}  // namespace pangea::vio

#pragma once

// Completes keyframes in the order of publication: adds the odometry edge from the previous
// keyframe and the preintegrated IMU measurement of the same span.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <set>

#include "vio/imu/imu_buffer.h"
#include "vio/keyframes/track_history.h"
#include "vio/window/estimator.h"
#include "vio/window/window_problem.h"

namespace pangea::vio {

class KeyframeEdges {
 public:
  // Publishes frame `index` of the window, whose covariance is P.
  FinishedKeyframe Finish(WindowState& state, const Eigen::MatrixXd& P, const TrackHistory& history,
                          const ImuBuffer& imu, int index);
  // Records the contradicted IMU factors; a keyframe whose span contains one gets no
  // preintegration.
  void NoteContradicted(const WindowProblem& problem);
  // utime of the last published keyframe; empty if there is none.
  std::optional<int64_t> last_utime() const;

 private:
  bool ContradictedWithin(int64_t after_utime, int64_t to_utime) const;

  std::optional<FinishedKeyframe> last_;
  Matrix6d last_covariance_ = Matrix6d::Zero();  // of last_'s pose, at publication
  std::set<int64_t> contradicted_utimes_;        // ends of contradicted IMU factors
};

}  // namespace pangea::vio

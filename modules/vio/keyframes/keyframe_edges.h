#pragma once

// Completes keyframes in the order of publication: adds the odometry edge from the previous
// keyframe and the preintegrated IMU measurement of the same span.
//
// The edge is the motion as the window has it now. Since the previous keyframe was published, the
// window may have corrected its pose; while a wrong time offset or scale converges, by tens of
// sigmas. So chained edges are better than published poses, and differ from these.

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
  std::set<int64_t> contradicted_utimes_;  // ends of contradicted IMU factors
};

}  // namespace pangea::vio

#pragma once

// Decides which tracks are landmarks of the window, and keeps their estimates between images.

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "vio/keyframes/track_history.h"
#include "vio/window/window_problem.h"

namespace pangea::vio {

class LandmarkStore {
 public:
  // Returns the landmarks of the window: tracks seen often enough, with a depth. New ones are
  // triangulated.
  std::vector<Landmark> Gather(const WindowState& state, const TrackHistory& history) const;
  // Keeps the estimates of the problem's landmarks, and forgets all others.
  void Keep(const WindowProblem& problem);
  // The track's observations up to this image are in the prior, so only later ones are used again.
  void StartAnew(int32_t landmark_id, int64_t after_utime) {
    from_utime_[landmark_id] = after_utime;
  }
  // Forgets the tracks that no frame in `history` contains any more.
  void Forget(const TrackHistory& history);

 private:
  struct Known {
    int64_t anchor_utime = 0;
    Eigen::Vector3d ray_rho = Eigen::Vector3d::Zero();
  };
  std::map<int32_t, Known> known_;
  std::map<int32_t, int64_t> from_utime_;  // observations up to this have been used
};

}  // namespace pangea::vio

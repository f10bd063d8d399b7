#pragma once

// Which tracks are landmarks of the window, and what is known of them between two images.

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "vio/keyframes/track_history.h"
#include "vio/window/window_problem.h"

namespace pangea::vio {

class LandmarkStore {
 public:
  // The landmarks of the window: tracks seen often enough, with a depth. New ones are triangulated.
  std::vector<Landmark> Gather(const WindowState& state, const TrackHistory& history) const;
  // Remembers the landmarks' estimates, and forgets all others.
  void Keep(const WindowProblem& problem);
  // What a track has told so far is in the prior: it starts anew after this image.
  void StartAnew(int32_t landmark_id, int64_t after_utime) {
    from_utime_[landmark_id] = after_utime;
  }
  // Forgets tracks that no frame holds any more.
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

#pragma once

// What each clone of the window saw, by landmark.

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "vio/point_geometry.h"
#include "vio/tracks.h"
#include "vio/window_state.h"

namespace pangea::vio {

class TrackHistory {
 public:
  // The observations of the newest clone. `ray_sigma` is that of an observation with sigma_px 1.
  void AddFrame(const TrackedFrame& frame, double ray_sigma);
  void RemoveFrame(int64_t utime) { frames_.erase(utime); }

  // All of one landmark's rays in the window's clones from `from_utime` on, oldest first.
  std::vector<ClonedRay> RaysOf(int32_t landmark_id, const WindowState& state,
                                int64_t from_utime) const;
  bool Sees(int64_t utime, int32_t landmark_id) const;
  const std::map<int32_t, ClonedRay>& Frame(int64_t utime) const;  // ClonedRay::clone is not set

  // Median shift between two frames' shared landmarks, rotation taken out, in rays; and how many
  // they share.
  struct Shift {
    double median = 0;
    size_t shared = 0;
  };
  Shift ShiftBetween(int64_t from_utime, int64_t to_utime,
                     const Eigen::Quaterniond& q_to_from) const;

 private:
  std::map<int64_t, std::map<int32_t, ClonedRay>> frames_;
};

}  // namespace pangea::vio

#pragma once

// The observations of each frame of the window, by landmark.

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "core/camera_model.h"
#include "vio/front_end/tracks.h"
#include "vio/window/landmarks/point_geometry.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

class TrackHistory {
 public:
  // Adds the observations of a new frame. `ray_sigma`: of an observation with sigma_px 1, on the
  // plane z = 1.
  void AddFrame(const TrackedFrame& frame, const CameraModel& camera, double ray_sigma);
  void RemoveFrame(int64_t utime) { frames_.erase(utime); }
  void RemoveLandmark(int32_t landmark_id);

  // The rays of every landmark in the window's full frames with is_tracked, oldest frame first;
  // landmarks in ascending order of ids.
  struct Track {
    int32_t landmark_id = 0;
    std::vector<FrameRay> rays;
  };
  std::vector<Track> Tracks(const WindowState& state) const;
  // The observations of one frame in order of landmark ids; FrameRay::frame is not set. Empty for
  // an unknown frame.
  using SeenLandmarks = std::vector<std::pair<int32_t, FrameRay>>;
  const SeenLandmarks& Frame(int64_t utime) const;
  bool Sees(int32_t landmark_id) const;                   // in any frame
  size_t Shared(int64_t a_utime, int64_t b_utime) const;  // number of landmarks in both
  // Whether enough tracks of an earlier image continue in another for it to count as tracked.
  bool Continues(int64_t from_utime, int64_t to_utime) const;

  // Median shift of the landmarks that two frames share, rotation taken out, on the plane z = 1;
  // and their number.
  struct Shift {
    double median = 0;
    size_t shared = 0;
  };
  Shift ShiftBetween(int64_t from_utime, int64_t to_utime,
                     const Eigen::Quaterniond& q_to_from) const;

  // Shift of the landmarks that two frames share, rotation not taken out, in sigmas of a ray.
  // Infinite if they share too few.
  struct ShiftSigmas {
    double median = 0;  // 1.7 if nothing moves
    double most = 0;    // 80 % quantile: 2.5 if nothing moves
  };
  ShiftSigmas ShiftSigmasBetween(int64_t from_utime, int64_t to_utime) const;

 private:
  std::map<int64_t, SeenLandmarks> frames_;
};

}  // namespace pangea::vio

#pragma once

// What each frame of the window saw, by landmark.

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "core/camera_model.h"
#include "vio/front_end/tracks.h"
#include "vio/window/point_geometry.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

class TrackHistory {
 public:
  // The observations of the newest frame. `ray_sigma` is that of an observation with sigma_px 1.
  void AddFrame(const TrackedFrame& frame, const CameraModel& camera, double ray_sigma);
  void RemoveFrame(int64_t utime) { frames_.erase(utime); }
  void RemoveLandmark(int32_t landmark_id);

  // Every landmark's rays in the window's full frames that are tracked, oldest first; landmarks in
  // order of their ids.
  struct Track {
    int32_t landmark_id = 0;
    std::vector<FrameRay> rays;
  };
  std::vector<Track> Tracks(const WindowState& state) const;
  // What one frame saw, in the same order; FrameRay::frame is not set.
  using SeenLandmarks = std::vector<std::pair<int32_t, FrameRay>>;
  const SeenLandmarks& Frame(int64_t utime) const;
  bool Sees(int32_t landmark_id) const;                   // whether any frame did
  size_t Shared(int64_t a_utime, int64_t b_utime) const;  // landmarks that both frames saw

  // Median shift between two frames' shared landmarks, rotation taken out, in rays; and how many
  // they share.
  struct Shift {
    double median = 0;
    size_t shared = 0;
  };
  Shift ShiftBetween(int64_t from_utime, int64_t to_utime,
                     const Eigen::Quaterniond& q_to_from) const;

  // Median shift between two frames' shared landmarks as it is, in sigmas of a ray: 1.7 when
  // nothing moves. Infinite with too few to tell.
  double MedianShiftSigmas(int64_t from_utime, int64_t to_utime) const;

 private:
  std::map<int64_t, SeenLandmarks> frames_;
};

}  // namespace pangea::vio

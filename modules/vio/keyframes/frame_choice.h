#pragma once

// Which frames hold a place in the window, and which are keyframes: by how far the image has moved,
// rotation taken out, and by how many tracks are left. The newest frame of the window is the one
// that is decided on.

#include <cstdint>

#include "vio/keyframes/track_history.h"
#include "vio/window/estimator.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

inline constexpr double kKeyframeInterval_s = 5;  // between keyframes, at most

class FrameChoice {
 public:
  FrameChoice(const EstimatorOptions& options, const CameraModel& camera)
      : options_(options), pixel_angle_(camera.PixelAngle()) {}

  // Whether the newest frame is worth a place beside the one before it.
  bool IsWorthAPlace(const WindowState& state, const TrackHistory& history) const;
  // Decides whether the newest frame is a keyframe, and whether it is a window keyframe.
  void Choose(const TrackHistory& history, WindowState* state);

 private:
  EstimatorOptions options_;
  double pixel_angle_;
  int64_t last_keyframe_utime_ = 0;
};

}  // namespace pangea::vio

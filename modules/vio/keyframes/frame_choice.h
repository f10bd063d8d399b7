#pragma once

// Decides which frames keep a place in the window, and which are keyframes: by the parallax (median
// shift of the features, rotation taken out) and by the share of tracks that are left. The decision
// is on the newest frame of the window.

#include <cstdint>

#include "vio/keyframes/track_history.h"
#include "vio/window/estimator.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

inline constexpr double kKeyframeInterval_s = 5;  // maximum between keyframes

class FrameChoice {
 public:
  FrameChoice(const EstimatorOptions& options, const CameraModel& camera)
      : options_(options), pixel_angle_(camera.PixelAngle()) {}

  // Whether the newest frame differs enough from the previous one to keep a place in the window.
  bool IsWorthAPlace(const WindowState& state, const TrackHistory& history) const;
  // Decides whether the newest frame is a keyframe, and whether it is a window keyframe.
  void Choose(const TrackHistory& history, WindowState* state);

 private:
  EstimatorOptions options_;
  double pixel_angle_;
  int64_t last_keyframe_utime_ = 0;
};

}  // namespace pangea::vio

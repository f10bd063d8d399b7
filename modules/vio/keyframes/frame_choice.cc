#include "vio/keyframes/frame_choice.h"

#include <algorithm>
#include <limits>

namespace pangea::vio {
namespace {

// A frame becomes a window keyframe, or a keyframe, if less than this share of the last one's
// tracks is left.
constexpr double kWindowTrackShare = 0.7;
constexpr double kKeyframeTrackShare = 0.5;
constexpr double kStationaryTrackShare = 0.5;
constexpr double kMinKeyframeInterval_s = 0.2;
constexpr double kAnyParallax = std::numeric_limits<double>::infinity();

// Whether the newest image differs enough from another frame of the window.
bool HasMoved(const WindowState& state, const TrackHistory& history, int64_t since_utime,
              double parallax, double track_share) {
  const auto since = state.Find(since_utime);
  if (!since || state.frames[*since].pose_only) {
    return true;  // no observations of that frame are left to compare with
  }
  const WindowFrame& newest = state.frames.back();
  const Eigen::Quaterniond q_newest_since =
      (newest.imu.T_odom_body.q * state.T_body_cam.q).conjugate() *
      (state.frames[*since].imu.T_odom_body.q * state.T_body_cam.q);
  const TrackHistory::Shift shift = history.ShiftBetween(since_utime, newest.utime, q_newest_since);
  const double share =
      static_cast<double>(shift.shared) /
      std::max<double>(1.0, static_cast<double>(history.Frame(since_utime).size()));
  return shift.median > parallax || share < track_share;
}

}  // namespace

bool FrameChoice::IsWorthAPlace(const WindowState& state, const TrackHistory& history) const {
  const WindowFrame& newest = state.frames.back();
  const WindowFrame& last = state.frames[state.Newest() - 1];
  if (newest.stationary) {
    // The first stationary frame stands for all that follow, until too few of its tracks are left.
    return !last.stationary ||
           HasMoved(state, history, last.utime, kAnyParallax, kStationaryTrackShare);
  }
  return HasMoved(state, history, last.utime, options_.window_parallax_px * pixel_angle_,
                  kWindowTrackShare);
}

void FrameChoice::Choose(const TrackHistory& history, WindowState* state) {
  WindowFrame& newest = state->frames.back();
  const double elapsed_s = 1e-6 * static_cast<double>(newest.utime - last_keyframe_utime_);
  newest.is_keyframe =
      last_keyframe_utime_ == 0 || elapsed_s >= kKeyframeInterval_s ||
      (elapsed_s >= kMinKeyframeInterval_s && !newest.stationary && newest.is_tracked &&
       HasMoved(*state, history, last_keyframe_utime_, options_.keyframe_parallax_px * pixel_angle_,
                kKeyframeTrackShare));
  if (newest.is_keyframe) {
    last_keyframe_utime_ = newest.utime;
  }
  newest.is_window_keyframe =
      newest.is_keyframe || state->frames.size() == 1 || IsWorthAPlace(*state, history);
}

}  // namespace pangea::vio

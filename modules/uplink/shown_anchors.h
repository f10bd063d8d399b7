#pragma once

// The poses at which an app draws the agent's anchors, in the odom frame of the agent's map. They
// move smoothly to the anchors' true poses, so that no anchor jumps when the server corrects the
// map.
//
// A new anchor is shown at its pose at once. When its pose changes in the same map, the shown pose
// follows at 0.1 m/s and 0.2 rad/s, or faster, up to 0.25 m/s, if it would take longer than 3 s.
// However late Poll is called, one step is at most that of a twentieth of a second: 12.5 mm,
// 10 mrad. An anchor that people have moved, or that is in another map now, is shown at its new
// pose at once.
//
// A state machine: monotonic microseconds go in; no clock, no bus; not thread safe. The caller
// bounds the number of anchors.

#include <cstdint>
#include <map>
#include <optional>

#include "core/anchor.h"

namespace pangea {

class ShownAnchorsBlend {
 public:
  // Takes the newest state of an anchor; a gone anchor is erased.
  void Set(const AnchorState& state);
  void Erase(const AnchorId& id);
  // Time and map of the agent's newest pose.
  void OnPose(int64_t utime, const MapId& map);
  // The same for a keyframe, for an odometry that publishes no poses.
  void OnKeyframe(int64_t utime, const MapId& map);

  // The anchors to publish now, if it is time: 20 times per second while a shown pose moves, else
  // once per second. Nothing before there was an anchor and a pose.
  std::optional<ShownAnchors> Poll(int64_t now_us);
  // Whether a shown pose still moves. Then Poll must be called every few milliseconds.
  bool moving() const { return moving_; }

 private:
  struct Entry {
    int64_t revision = 0;
    int32_t edited_by = 0;
    MapId map;
    Rigid3 T_odom_anchor;  // the true pose
    Rigid3 T_odom_shown;
    double speed = 0;  // m/s; 0: the shown pose is the true one
  };
  static bool Step(double seconds, Entry* entry);
  void Look();

  std::map<AnchorId, Entry> anchors_;
  bool any_ever_ = false;
  bool has_pose_ = false;
  std::optional<MapId> map_;
  int64_t utime_ = 0;
  bool moving_ = false;
  bool changed_ = false;
  std::optional<int64_t> published_us_;
};

}  // namespace pangea

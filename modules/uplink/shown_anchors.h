#pragma once

// Where an app draws the agent's anchors, in the odom frame of the agent's map: on their way from
// where they were shown to where they are, so that none jumps when the server corrects the map.
//
// A new anchor is shown at once where it is. When it moves within the same map, what is shown
// follows at 0.1 m/s and 0.2 rad/s; faster where the way would take longer than 3 s, up to 0.25
// m/s. However late Poll is called, no step is longer than what a twentieth of a second
// allows: 12.5 mm, 10 mrad. An anchor that people have edited, or that comes in another map, is
// shown at once where it is now.
//
// A state machine: monotonic microseconds go in; no clock, no bus, one thread. As large as what is
// set.

#include <cstdint>
#include <map>
#include <optional>

#include "core/anchor.h"

namespace pangea {

class ShownAnchorsBlend {
 public:
  // The anchor's newest state.
  void Set(const AnchorState& state);
  void Erase(const AnchorId& id);
  // The agent's newest pose, and the map it is in.
  void OnPose(int64_t utime, const MapId& map);
  // The same of a keyframe, for an odometry that publishes no pose.
  void OnKeyframe(int64_t utime, const MapId& map);

  // What to publish now: 20 times a second while something moves, else once a second; nothing
  // before there has been an anchor and a pose.
  std::optional<ShownAnchors> Poll(int64_t now_us);
  // Something is still on its way: call Poll every few milliseconds.
  bool moving() const { return moving_; }

 private:
  struct Entry {
    int64_t revision = 0;
    int32_t edited_by = 0;
    MapId map;
    Rigid3 T_odom_anchor;  // where it is
    Rigid3 T_odom_shown;
    double speed = 0;  // m/s; 0: it has arrived
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

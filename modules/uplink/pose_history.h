#pragma once

// Where the agent was in the newest seconds, so that an app may say "in front of me, then", and the
// server need not interpolate between keyframes, in whose intervals a hand turns by degrees.
//
// In: POSE_k while it tracks, and the agent's keyframes. Out: the pose at a time. The odometry
// knows a keyframe better when it leaves the window than it knew the pose live (seconds later; half
// a degree soon after the start). So between two keyframes the live poses say how it moved, and the
// keyframes say where it was. Bounded: kLength_us of one map, kMaxPoses.

#include <cstdint>
#include <deque>
#include <optional>

#include "core/ids.h"
#include "core/rigid3.h"

namespace pangea {

class PoseHistory {
 public:
  static constexpr int64_t kLength_us = 20'000'000;
  static constexpr int64_t kMaxGap_us = 200'000;  // interpolated over
  static constexpr size_t kMaxPoses = 4000;

  void AddPose(int64_t utime, const MapId& map, const Rigid3& T_odom_body);
  void AddKeyframe(int64_t utime, const MapId& map, const Rigid3& T_odom_body);
  // T_odom_body; nothing where there are no poses around that time.
  std::optional<Rigid3> At(int64_t utime, const MapId& map) const;
  // A keyframe at or after that time has come: At will not get better.
  bool IsSettled(int64_t utime, const MapId& map) const;

 private:
  struct Entry {
    int64_t utime = 0;
    Rigid3 T_odom_body;
  };
  // Of a keyframe: from the live pose to its own.
  struct Correction {
    int64_t utime = 0;
    Rigid3 T_odom_live;
  };

  void Open(const MapId& map);
  std::optional<Rigid3> Live(int64_t utime) const;

  MapId map_;
  std::deque<Entry> poses_;
  std::deque<Correction> corrections_;
};

}  // namespace pangea

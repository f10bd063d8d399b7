#pragma once

// The agent's poses of the last seconds. With them an app can place an anchor "in front of me at
// that time", and the server need not interpolate between keyframes, between which a hand rotates
// by degrees.
//
// In: POSE_k while the odometry tracks, and the agent's keyframes. Out: the pose at a given time.
// The pose of a keyframe, which leaves the window seconds later, is more accurate than the live
// pose was (by half a degree soon after the start). So the result follows the live poses between
// two keyframes, but is corrected to agree with the keyframes. The poses of the map before are kept
// too: it may end while a person names an anchor. Bounded: for each map kLength_us, kMaxPoses.

#include <cstdint>
#include <deque>
#include <optional>

#include "core/ids.h"
#include "core/rigid3.h"

namespace pangea {

class PoseHistory {
 public:
  static constexpr int64_t kLength_us = 20'000'000;
  static constexpr int64_t kMaxGap_us = 200'000;  // longest gap to interpolate over
  static constexpr size_t kMaxPoses = 4000;

  void AddPose(int64_t utime, const MapId& map, const Rigid3& T_odom_body);
  void AddKeyframe(int64_t utime, const MapId& map, const Rigid3& T_odom_body);
  // T_odom_body at `utime`; nothing if there are no poses around that time.
  std::optional<Rigid3> At(int64_t utime, const MapId& map) const;
  // Whether a keyframe at or after that time has come, or the map has ended; the result of At will
  // not improve any more.
  bool IsSettled(int64_t utime, const MapId& map) const;

 private:
  struct Entry {
    int64_t utime = 0;
    Rigid3 T_odom_body;
  };
  // For a keyframe: its pose is T_odom_live times the live pose at its time.
  struct Correction {
    int64_t utime = 0;
    Rigid3 T_odom_live;
  };

  struct OfMap {
    MapId map;
    std::deque<Entry> poses;
    std::deque<Correction> corrections;

    std::optional<Rigid3> Live(int64_t utime) const;
  };

  OfMap now_, before_;
};

}  // namespace pangea

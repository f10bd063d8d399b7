#pragma once

// Where the odometry had the agent in the newest seconds, so that an app may say "where I was then"
// and the server need not interpolate between keyframes, in whose intervals a hand turns by
// degrees.
//
// In: POSE_k while it tracks, ascending. Bounded: kLength_us of one map, kMaxPoses.

#include <cstdint>
#include <deque>
#include <optional>

#include "core/ids.h"
#include "core/rigid3.h"

namespace pangea {

class PoseHistory {
 public:
  static constexpr int64_t kLength_us = 5'000'000;
  static constexpr int64_t kMaxGap_us = 200'000;  // interpolated over
  static constexpr size_t kMaxPoses = 2000;

  void Add(int64_t utime, const MapId& map, const Rigid3& T_odom_body);
  // Between the two poses around that time; nothing where there are none.
  std::optional<Rigid3> At(int64_t utime, const MapId& map) const;

 private:
  struct Entry {
    int64_t utime = 0;
    Rigid3 T_odom_body;
  };

  MapId map_;
  std::deque<Entry> poses_;
};

}  // namespace pangea

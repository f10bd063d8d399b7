#pragma once

// Where agents are now, for the others of their group.
//
// In: the newest pose of each agent, as it was heard. Out: for each agent that tracks, the cameras
// of the others of its group in its own odom frame. What was heard kFresh_us ago counts no more:
// who is lost or away is not shown where it was. Bounded: kMaxAgents; of one agent the nearest
// kMaxOthers.

#include <cstdint>
#include <map>
#include <vector>

#include "anchors/anchors.h"
#include "core/others.h"

namespace pangea {

class OtherAgents {
 public:
  static constexpr int64_t kFresh_us = 2'000'000;
  static constexpr size_t kMaxAgents = 1000;

  void Take(const MapId& map, const Rigid3& T_odom_body, int64_t now_utime);
  // `anchors`: what the maps and groups are. Nothing for an agent that is alone.
  std::vector<Others> ForEach(const Anchors& anchors, int64_t now_utime);

 private:
  struct Heard {
    MapId map;
    Rigid3 T_odom_body;
    int64_t utime = 0;
  };
  std::map<int32_t, Heard> agents_;
};

}  // namespace pangea

#pragma once

// The present poses of agents, for the other agents of their group.
//
// Input: the newest pose of each agent. Output: for each tracking agent, the camera poses of the
// others in its group, in its own odom frame. A pose older than kFresh_us is not used: an agent
// that is lost or offline is not shown. Bounded: kMaxAgents agents; for each, the nearest
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
  // `anchors`: has the maps and groups. No entry for an agent that is alone in its group.
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

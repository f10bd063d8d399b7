#include "anchors/other_agents.h"

#include <algorithm>
#include <utility>

namespace pangea {
namespace {

struct InGroup {
  int32_t agent_id = 0;
  MapId map;
  Rigid3 T_map_odom;
  Rigid3 T_map_cam;
};

Others OthersOf(const InGroup& self, const std::vector<InGroup>& group) {
  std::vector<std::pair<double, const InGroup*>> near;
  for (const InGroup& other : group) {
    if (other.agent_id != self.agent_id) {
      near.emplace_back((other.T_map_cam.t - self.T_map_cam.t).norm(), &other);
    }
  }
  std::ranges::sort(near);
  near.resize(std::min(near.size(), kMaxOthers));
  Others others{self.map, {}};
  for (const auto& [away_m, other] : near) {
    others.others.push_back({other->agent_id, self.T_map_odom.Inverse() * other->T_map_cam});
  }
  return others;
}

}  // namespace

void OtherAgents::Take(const MapId& map, const Rigid3& T_odom_body, int64_t now_utime) {
  if (agents_.contains(map.agent_id) || agents_.size() < kMaxAgents) {
    agents_[map.agent_id] = {map, T_odom_body, now_utime};
  }
}

std::vector<Others> OtherAgents::ForEach(const Anchors& anchors, int64_t now_utime) {
  std::erase_if(
      agents_, [now_utime](const auto& item) { return now_utime - item.second.utime > kFresh_us; });
  std::map<MapId, std::vector<InGroup>> groups;
  for (const auto& [agent_id, heard] : agents_) {
    const auto T_body_cam = anchors.T_body_cam(heard.map);
    const auto [group, revision] = anchors.GroupAndRevision(heard.map);
    if (T_body_cam && revision > 0) {
      const Rigid3 T_map_odom = anchors.T_map_odom(heard.map);
      groups[group].push_back(
          {agent_id, heard.map, T_map_odom, T_map_odom * heard.T_odom_body * *T_body_cam});
    }
  }
  std::vector<Others> for_each;
  for (const auto& [group, members] : groups) {
    for (const InGroup& self : members) {
      if (Others others = OthersOf(self, members); !others.others.empty()) {
        for_each.push_back(std::move(others));
      }
    }
  }
  return for_each;
}

}  // namespace pangea

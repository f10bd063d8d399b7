#include "report/metrics/group_history.h"

#include <algorithm>
#include <cmath>

namespace pangea {
namespace {

bool Together(const std::map<MapId, size_t>& group_of, const MapId& map, int32_t agent) {
  const auto own = group_of.find(map);
  return own != group_of.end() && std::ranges::any_of(group_of, [&](const auto& other) {
           return other.first.agent_id == agent && other.second == own->second;
         });
}

}  // namespace

std::map<MapId, size_t> GroupHistory::At(size_t num_changes) const {
  std::map<MapId, size_t> group_of;
  for (size_t i = 0; i < num_changes; ++i) {
    for (const MapId& map : session_.changes[i].maps) {
      group_of[map] = i;
    }
  }
  return group_of;
}

std::set<int32_t> GroupHistory::AgentsWith(const MapId& map) const {
  const std::map<MapId, size_t> group_of = At(session_.changes.size());
  const auto own = group_of.find(map);
  std::set<int32_t> agents{map.agent_id};
  for (const auto& [other, group] : group_of) {
    if (own != group_of.end() && group == own->second) {
      agents.insert(other.agent_id);
    }
  }
  return agents;
}

std::optional<int64_t> GroupHistory::TogetherSince(const MapId& map, int32_t agent) const {
  std::optional<int64_t> since;
  std::map<MapId, size_t> group_of;
  for (size_t i = 0; i < session_.changes.size(); ++i) {
    for (const MapId& changed : session_.changes[i].maps) {
      group_of[changed] = i;
    }
    if (!Together(group_of, map, agent)) {
      since.reset();
    } else if (!since) {
      since = session_.begin_utime + std::llround(1e6 * session_.changes[i].session_s);
    }
  }
  return since;
}

}  // namespace pangea

#pragma once

// Computes which agents were in one group, and since when.

#include <cstdint>
#include <map>
#include <optional>
#include <set>

#include "report/report_log.h"

namespace pangea {

class GroupHistory {
 public:
  // `session` must outlive this.
  explicit GroupHistory(const CapturedSession& session) : session_(session) {}

  // Agents with a map in this map's group at the end, including its own agent.
  std::set<int32_t> AgentsWith(const MapId& map) const;
  // Time (wall clock, microseconds) since which the map has been in one group with a map of the
  // agent until the end; empty if they are not together at the end.
  std::optional<int64_t> TogetherSince(const MapId& map, int32_t agent) const;

 private:
  // The group of each map after the first `num_changes` changes, as a number shared by its maps. A
  // map that is not contained is alone.
  std::map<MapId, size_t> At(size_t num_changes) const;

  const CapturedSession& session_;
};

}  // namespace pangea

#pragma once

// Which agents were in one group, and since when.

#include <cstdint>
#include <map>
#include <optional>
#include <set>

#include "report/report_log.h"

namespace pangea::session {

class GroupHistory {
 public:
  // `session` must outlive this.
  explicit GroupHistory(const CapturedSession& session) : session_(session) {}

  // Agents with a map in its group at the end, its own included.
  std::set<int32_t> AgentsWith(const MapId& map) const;
  // Wall clock, microseconds, since when the map is in one group with one of the agent's, for good;
  // none when they are apart at the end.
  std::optional<int64_t> TogetherSince(const MapId& map, int32_t agent) const;

 private:
  // The group of each map after the first so many changes, as a number that its maps share; a map
  // that is in none of them is alone.
  std::map<MapId, size_t> At(size_t num_changes) const;

  const CapturedSession& session_;
};

}  // namespace pangea::session

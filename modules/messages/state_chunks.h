#pragma once

// Joins the chunks (map_state_t) in which a group's state crosses the bus.
//
// In: chunks in any order, repeats allowed. Out: whole states. Bounded: at most kMaxPending states
// that lack a chunk, with at most kMaxChunks chunks in all; beyond that, the state with the lowest
// revision is dropped.

#include <map>
#include <optional>
#include <utility>

#include "core/server_messages.h"

namespace pangea {

class StateChunks {
 public:
  static constexpr size_t kMaxPending = 100;
  static constexpr size_t kMaxChunks = 5000;  // 200 MB

  // Adds a chunk. Returns the whole state if no other chunk is missing; its keyframes are in the
  // order of the chunks.
  std::optional<MapState> Add(int chunk, int num_chunks, MapState part);

  size_t pending() const { return pending_.size(); }

 private:
  // Revisions increase over all groups, so a revision identifies a state.
  std::map<std::pair<int64_t, MapId>, std::map<int, MapState>> pending_;
  size_t num_chunks_ = 0;
};

}  // namespace pangea

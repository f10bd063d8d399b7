#pragma once

// Puts a group's state, which crosses the bus in chunks (map_state_t), together again.
//
// In: chunks in any order, repeats allowed. Out: each whole state once. Bounded: of more than
// kMaxPending states that lack a chunk, or kMaxChunks of their chunks, the one with the lowest
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

  // The whole state when this was the last chunk it lacked; keyframes in the order of the chunks.
  std::optional<MapState> Add(int chunk, int num_chunks, MapState part);

  size_t pending() const { return pending_.size(); }

 private:
  // Revisions increase over all groups, so one names a state.
  std::map<std::pair<int64_t, MapId>, std::map<int, MapState>> pending_;
  size_t num_chunks_ = 0;
};

}  // namespace pangea

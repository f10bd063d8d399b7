#include "messages/state_chunks.h"

#include <algorithm>
#include <iterator>

namespace pangea {

std::optional<MapState> StateChunks::Add(int chunk, int num_chunks, MapState part) {
  const std::pair key(part.revision, part.group);
  auto& chunks = pending_[key];
  num_chunks_ += chunks.emplace(chunk, std::move(part)).second ? 1 : 0;
  if (chunks.size() < static_cast<size_t>(num_chunks)) {
    if (pending_.size() > kMaxPending || num_chunks_ > kMaxChunks) {
      num_chunks_ -= pending_.begin()->second.size();
      pending_.erase(pending_.begin());
    }
    return std::nullopt;
  }
  MapState whole = std::move(chunks.begin()->second);
  for (auto it = std::next(chunks.begin()); it != chunks.end(); ++it) {
    std::move(it->second.keyframes.begin(), it->second.keyframes.end(),
              std::back_inserter(whole.keyframes));
  }
  num_chunks_ -= chunks.size();
  pending_.erase(key);
  return whole;
}

}  // namespace pangea

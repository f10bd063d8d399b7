#include "agent_handler/anchor_table.h"

#include <algorithm>
#include <utility>

namespace pangea {

bool AnchorTable::MakeRoom(const MapId& map) {
  const auto done = std::ranges::find_if(anchors_, [&](const auto& item) {
    const Entry& entry = item.second;
    return entry.map != map || (entry.gone && !unconfirmed_.contains(entry.number));
  });
  if (done == anchors_.end()) {
    return false;
  }
  unconfirmed_.erase(done->second.number);
  queue_.Remove(done->first);
  anchors_.erase(done);
  return true;
}

bool AnchorTable::Set(const AnchorState& state, std::vector<uint8_t> message) {
  const AnchorId& id = state.anchor;
  if (!anchors_.contains(id) && anchors_.size() >= kMaxAnchors && !MakeRoom(state.map)) {
    return false;
  }
  Entry& entry = anchors_[id];
  if (entry.message == message) {
    return true;
  }
  unconfirmed_.erase(entry.number);
  entry = {std::move(message), state.map, state.gone, ++last_number_};
  unconfirmed_[entry.number] = id;
  queue_.Add(id);
  return true;
}

void AnchorTable::OnNewSession() {
  for (const auto& [id, entry] : anchors_) {
    unconfirmed_[entry.number] = id;
    queue_.Add(id);
  }
}

void AnchorTable::OnReceived(const std::vector<int64_t>& numbers) {
  for (const int64_t number : numbers) {
    if (const auto confirmed = unconfirmed_.extract(number)) {
      queue_.Remove(confirmed.mapped());
    }
  }
}

std::optional<std::vector<uint8_t>> AnchorTable::Next(int64_t now_us) {
  const auto id = queue_.Next(now_us);
  if (!id) {
    return std::nullopt;
  }
  const Entry& entry = anchors_.at(*id);
  return EncodeAnchor(entry.number, entry.message);
}

}  // namespace pangea

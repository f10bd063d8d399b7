#pragma once

// What a process does about messages that did not come: it asks for them again.

#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "bus/node.h"
#include "bus/retransmission/gap_requests.h"
#include "bus/retransmission/reorder_buffer.h"
#include "messages/catch_up_messages.h"
#include "messages/channels.h"
#include "pangea/again_t.hpp"

namespace pangea {

// RESEND_REQUEST for the gap's messages of a channel; the answers come on AGAIN_<node's name>.
void RequestRetransmission(Node& node, const std::string& channel, const SeqGap& gap);
// The same for all the messages from a map's first keyframe to its `highest_seq`th, in several
// requests; for small messages.
void RequestAllRetransmissions(Node& node, const std::string& channel, const MapId& map,
                               int32_t highest_seq);

// VERDICT_REQUEST for the verification results of these names (at most ResultNames::kMax).
void RequestResults(Node& node, const ResultNames& names);

// The answer to such a request.
template <typename Message>
void Retransmit(Node& node, const std::string& requester, const std::string& channel,
                const Message& message) {
  again_t again{};
  again.channel = channel;
  again.data = EncodeMessage(message);
  again.num_bytes = static_cast<int32_t>(again.data.size());
  node.Publish(channels::Again(requester), again);
}

// Gives what an answer holds to `handler`, as Node::Listen would, if it is such a message (LCM's
// fingerprint tells); whether it is.
template <typename Message, typename Handler>
bool TakeRetransmission(Node& node, const again_t& again, const Handler& handler) {
  Message message{};
  const bool is_one = DecodeMessage(Bytes(again.data.data(), again.data.size()), &message);
  if (is_one) {
    node.Take(message, handler);
  }
  return is_one;
}
// MAP_STATE of the map's group again, to all, with the corrections of its maps.
void AskForState(Node& node, const MapId& map);

// Which messages of each map are missing, of a stream whose order does not matter.
class MissingMessages {
 public:
  void Note(const MapId& map, int32_t seq) { stream_.Add(map, seq, {}); }
  // What exists, and what nobody has any more.
  void Announce(const Have& have);
  bool Has(const MapId& map, int32_t seq) const { return stream_.Has(map, seq); }
  // Up to the map's `highest_seq`.
  bool Lacks(const MapId& map, int32_t highest_seq) const {
    return stream_.next(map) <= highest_seq;
  }
  const ReorderBuffer<std::monostate>& stream() const { return stream_; }
  void Restore(const MapId& map, int32_t next, const std::vector<int32_t>& waiting) {
    stream_.Restore(map, next, waiting);
  }
  // What is to be asked for now (gap_requests.h).
  std::vector<SeqGap> Due(int64_t now_utime) { return requests_.Due(stream_.Gaps(), now_utime); }

 private:
  ReorderBuffer<std::monostate> stream_;
  GapRequests requests_;
};

// Which of the maps that were there before this process no MAP_STATE has named since: whoever comes
// late asks the pose graph for them, and it says them again to all. Bound: kMaxAsked maps are asked
// for at once, each at most kMaxStateRequests times (a pose graph that comes later says its states
// itself).
class MissingStates {
 public:
  void Announce(const MapId& map) { times_asked_.try_emplace(map, 0); }
  void Note(const std::vector<MapId>& maps);
  std::vector<MapId> Due(int64_t now_utime);
  // None is missing, or none that anybody would still be asked for.
  bool empty() const { return times_asked_.empty(); }
  void Forget() { times_asked_.clear(); }

 private:
  static constexpr size_t kMaxAsked = 20;

  std::map<MapId, int> times_asked_;  // of those that are missing
  int64_t next_utime_ = 0;
};

}  // namespace pangea

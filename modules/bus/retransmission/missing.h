#pragma once

// Asking for messages that did not come, and answering such requests.

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
#include "messages/encoding.h"
#include "pangea/again_t.hpp"

namespace pangea {

// Publishes RESEND_REQUEST for the messages of a channel in the gap. The answers come on
// AGAIN_<node's name>.
void RequestRetransmission(Node& node, const std::string& channel, const SeqGap& gap);
// The same for all messages of a map with seq 0 to `highest_seq`, in several requests. Only for
// small messages.
void RequestAllRetransmissions(Node& node, const std::string& channel, const MapId& map,
                               int32_t highest_seq);

// Publishes VERDICT_REQUEST for the named verification results (at most ResultNames::kMax).
void RequestResults(Node& node, const ResultNames& names);

// Answers a RESEND_REQUEST or VERDICT_REQUEST: sends `message`, which belongs on `channel`, to the
// requester.
template <typename Message>
void Retransmit(Node& node, const std::string& requester, const std::string& channel,
                const Message& message) {
  again_t again{};
  again.channel = channel;
  again.data = EncodeMessage(message);
  again.num_bytes = static_cast<int32_t>(again.data.size());
  node.Publish(channels::Again(requester), again);
}

// If the answer contains a `Message` (LCM's fingerprint tells), handles it as Node::Listen would.
// Returns whether it does.
template <typename Message, typename Handler>
bool TakeRetransmission(Node& node, const again_t& again, const Handler& handler) {
  Message message{};
  const bool is_one = DecodeMessage(Bytes(again.data.data(), again.data.size()), &message);
  if (is_one) {
    node.Take(message, handler);
  }
  return is_one;
}
// Asks the pose graph to publish the MAP_STATE of the map's group again, and the corrections of its
// maps, and global_ba its REFINEMENT. All processes get them.
void AskForState(Node& node, const MapId& map);

// Which messages of each map are missing, for a stream in which the order does not matter.
class MissingMessages {
 public:
  void Note(const MapId& map, int32_t seq) { stream_.Add(map, seq, {}); }
  // Takes from HAVE which messages exist, and which are lost.
  void Announce(const Have& have);
  bool Has(const MapId& map, int32_t seq) const { return stream_.Has(map, seq); }
  // Whether a message of the map up to `highest_seq` is missing.
  bool Lacks(const MapId& map, int32_t highest_seq) const {
    return stream_.next(map) <= highest_seq;
  }
  const ReorderBuffer<std::monostate>& stream() const { return stream_; }
  void Restore(const MapId& map, int32_t next, const std::vector<int32_t>& waiting) {
    stream_.Restore(map, next, waiting);
  }
  // The gaps to ask for now (gap_requests.h).
  std::vector<SeqGap> Due(int64_t now_utime) { return requests_.Due(stream_.Gaps(), now_utime); }

 private:
  ReorderBuffer<std::monostate> stream_;
  GapRequests requests_;
};

// The maps that are older than this process and that no MAP_STATE has named since it started. A
// process that starts late asks the pose graph for them. At most kMaxAsked maps are asked for at
// once, and each at most kMaxStateRequests times; a pose graph that starts later publishes its
// states without being asked.
class MissingStates {
 public:
  void Announce(const MapId& map) { times_asked_.try_emplace(map, 0); }
  void Note(const std::vector<MapId>& maps);
  std::vector<MapId> Due(int64_t now_utime);
  // No state is missing, or all were asked for often enough.
  bool empty() const { return times_asked_.empty(); }
  void Forget() { times_asked_.clear(); }

 private:
  static constexpr size_t kMaxAsked = 20;

  std::map<MapId, int> times_asked_;  // only of maps whose state is missing
  int64_t next_utime_ = 0;
};

}  // namespace pangea

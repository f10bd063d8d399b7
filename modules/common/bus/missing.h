#pragma once

// What a process does about messages that did not come: it asks for them again.

#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "common/bus/in_order.h"
#include "common/bus/node.h"
#include "pangea/again_t.hpp"

namespace pangea {

// RESEND_REQUEST for the gap's messages of a channel; the answers come on AGAIN_<node's name>.
void AskAgain(Node& node, const std::string& channel, const SeqGap& gap);
// Gives an answer to `handler` if it holds such a message (LCM's fingerprint tells); whether it
// does.
template <typename Message, typename Handler>
bool TakeAgain(const again_t& again, Handler handler) {
  Message message{};
  const bool is_one = DecodeMessage(Bytes(again.data.data(), again.data.size()), &message);
  if (is_one) {
    handler(message);
  }
  return is_one;
}
// MAP_STATE of the map's group again, to all, with the corrections of its maps.
void AskForState(Node& node, const MapId& map);

// Which messages of each map are missing, of a stream whose order does not matter.
class MissingMessages {
 public:
  void Note(const MapId& map, int32_t seq) { stream_.Add(map, seq, {}); }
  // Somebody says this much exists (HAVE).
  void Announce(const MapId& map, int32_t highest_seq) { stream_.Announce(map, highest_seq); }
  // Nobody has these any more (the gaps in HAVE).
  void Skip(const SeqGap& gap) { stream_.Skip(gap); }
  // Up to the map's `highest_seq`.
  bool Lacks(const MapId& map, int32_t highest_seq) const {
    return stream_.next(map) <= highest_seq;
  }
  // The gaps that have stayed for a second, each at most every two, as much of each as may be asked
  // for at once.
  std::vector<SeqGap> Due(int64_t now_utime);

 private:
  struct Asked {
    int32_t from_seq = -1;
    int64_t next_utime = 0;
  };
  InOrder<std::monostate> stream_;
  std::map<MapId, Asked> asked_;
};

// Which of the maps that were there before this process no MAP_STATE has named since: whoever comes
// late asks the pose graph for them, and it says them again to all. Bound: kMaxAsked maps are asked
// for at once, each at most kMaxTimes (a pose graph that comes later says its states itself).
class MissingStates {
 public:
  void Announce(const MapId& map) { times_asked_.try_emplace(map, 0); }
  void Note(const std::vector<MapId>& maps);
  std::vector<MapId> Due(int64_t now_utime);

 private:
  static constexpr size_t kMaxAsked = 20;
  static constexpr int kMaxTimes = 5;

  std::map<MapId, int> times_asked_;  // of those that are missing
  int64_t next_utime_ = 0;
};

}  // namespace pangea

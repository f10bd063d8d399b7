#pragma once

// Puts one numbered stream per map back in order, drops repeats, and knows what is missing.
// Bounded: at most kMaxBuffered items wait per map; beyond that the newest are dropped (they will
// be asked for again).

#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

#include "core/ids.h"

namespace pangea {

template <typename T>
class ReorderBuffer {
 public:
  static constexpr size_t kMaxBuffered = 1000;

  // The items that are now in order (empty for a repeat or an item after a gap).
  std::vector<T> Add(const MapId& map, int32_t seq, T item) {
    Stream& stream = streams_[map];
    std::vector<T> ready;
    if (seq < stream.next || stream.buffered.contains(seq)) {
      return ready;
    }
    if (stream.buffered.size() >= kMaxBuffered && seq != stream.next) {
      stream.highest = std::max(stream.highest, seq);
      return ready;
    }
    stream.buffered.emplace(seq, std::move(item));
    stream.highest = std::max(stream.highest, seq);
    TakeReady(&stream, &ready);
    return ready;
  }

  // Nobody has these any more (the gaps in HAVE): the stream goes on after them. The items that are
  // now in order.
  std::vector<T> Skip(const SeqGap& gap) {
    Stream& stream = streams_[gap.map];
    std::vector<T> ready;
    if (gap.from_seq <= stream.next && stream.next <= gap.to_seq) {
      stream.next = gap.to_seq + 1;
      stream.buffered.erase(stream.buffered.begin(), stream.buffered.lower_bound(stream.next));
      TakeReady(&stream, &ready);
    }
    return ready;
  }

  // Somebody says this much exists (HAVE), so that a lost tail shows.
  void Announce(const MapId& map, int32_t highest_seq) {
    Stream& stream = streams_[map];
    stream.highest = std::max(stream.highest, highest_seq);
  }

  // The first gap of each map.
  std::vector<SeqGap> Gaps() const {
    std::vector<SeqGap> gaps;
    for (const auto& [map, stream] : streams_) {
      if (stream.next <= stream.highest) {
        const int32_t end =
            stream.buffered.empty() ? stream.highest : stream.buffered.begin()->first - 1;
        gaps.push_back({map, stream.next, end});
      }
    }
    return gaps;
  }

  // Whether it came already, or nobody has it any more.
  bool Has(const MapId& map, int32_t seq) const {
    const auto it = streams_.find(map);
    return it != streams_.end() && (seq < it->second.next || it->second.buffered.contains(seq));
  }
  int32_t next(const MapId& map) const {
    const auto it = streams_.find(map);
    return it == streams_.end() ? 0 : it->second.next;
  }
  size_t num_buffered() const {
    size_t count = 0;
    for (const auto& [map, stream] : streams_) {
      count += stream.buffered.size();
    }
    return count;
  }

  // visit(map, next, the seqs that wait behind a gap) for each map.
  template <typename Visit>
  void VisitStreams(Visit visit) const {
    for (const auto& [map, stream] : streams_) {
      std::vector<int32_t> waiting;
      for (const auto& [seq, item] : stream.buffered) {
        waiting.push_back(seq);
      }
      visit(map, stream.next, waiting);
    }
  }
  // As it was visited, of items that have no value of their own.
  void Restore(const MapId& map, int32_t next, const std::vector<int32_t>& waiting) {
    Stream& stream = streams_[map];
    stream.next = next;
    stream.highest = waiting.empty() ? next - 1 : waiting.back();
    for (const int32_t seq : waiting) {
      stream.buffered.emplace(seq, T{});
    }
  }

 private:
  struct Stream {
    int32_t next = 0;
    int32_t highest = -1;
    std::map<int32_t, T> buffered;
  };
  static void TakeReady(Stream* stream, std::vector<T>* ready) {
    for (auto it = stream->buffered.begin();
         it != stream->buffered.end() && it->first == stream->next;
         it = stream->buffered.erase(it)) {
      ready->push_back(std::move(it->second));
      ++stream->next;
    }
  }

  std::map<MapId, Stream> streams_;
};

}  // namespace pangea

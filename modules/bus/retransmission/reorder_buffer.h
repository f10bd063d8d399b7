#pragma once

// Puts the numbered items of each map in order, drops repeats, and knows which are missing. At most
// kMaxBuffered items per map wait for earlier ones; beyond that, new ones are dropped, and will be
// asked for again.

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

  // Adds an item and returns the items that are now in order: none for a repeat or behind a gap.
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

  // These items are lost: nobody has them any more (HAVE names such gaps). The stream goes on
  // behind them. Returns the items that are now in order.
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

  // Items up to `highest_seq` exist, as HAVE says. So also lost items at the end are known missing.
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

  // Whether the item came already or is lost.
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

  // Calls visit(map, next seq, seqs that wait behind a gap) for each map.
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
  // Restores a stream as VisitStreams gave it. The waiting items get the value T{}.
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

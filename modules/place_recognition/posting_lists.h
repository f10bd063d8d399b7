#pragma once

// The postings of one table of the index, by word, in little more than their signatures.
//
// All but the newest are packed: word after word, each list as its count, its newest keyframe, the
// gaps from keyframe to keyframe (all as base-128 varints; lists of an inverted index are coded so
// since Witten, Moffat & Bell, Managing Gigabytes, 1999), and the signatures. The newest wait in a
// chain for each word until Pack. A packed posting takes 5.5 bytes, a waiting one 12; a word 12.
//
// Deterministic; what is visited does not depend on when Pack was called. Not thread safe.

#include <cstdint>
#include <cstring>
#include <vector>

#include "core/byte_record.h"

namespace pangea {

class PostingLists {
 public:
  // Words are 0 .. num_words - 1.
  explicit PostingLists(size_t num_words) : begin_(num_words + 1, 0), newest_(num_words, kNone) {}

  // Keyframes come in ascending order.
  void Add(uint32_t word, int32_t keyframe, uint32_t signature);
  // Packs what waits. Takes the time to copy all of it: so it is worth while when much waits.
  void Pack();
  // With nothing waiting. False, and nothing has changed, if these are not the bytes of lists of so
  // many words.
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);
  size_t num_packed() const { return num_packed_; }
  size_t num_waiting() const { return waiting_.size(); }

  // What Sample will read of the word, so that the processor has it: first where its lists begin,
  // some words later the lists.
  void PrefetchBegin(uint32_t word) const {
    __builtin_prefetch(&begin_[word]);
    __builtin_prefetch(&newest_[word]);
  }
  void PrefetchLists(uint32_t word) const {
    __builtin_prefetch(packed_.data() + begin_[word]);
    if (newest_[word] != kNone) {
      __builtin_prefetch(&waiting_[newest_[word]]);
    }
  }

  // Calls visit(keyframe, signature), in any order, for the word's postings; of those that have
  // more than `most`, for an even sample of about this many, which `phase` rotates.
  template <typename Visit>
  void Sample(uint32_t word, size_t most, size_t phase, Visit visit) const {
    const size_t num_waiting = CountWaiting(word);
    Reader reader(packed_.data() + begin_[word], packed_.data() + begin_[word + 1]);
    const size_t num_packed = reader.count();
    const size_t stride = 1 + (num_packed + num_waiting) / most;
    size_t next = phase % stride;
    for (size_t i = 0; i < num_packed; ++i) {
      const int32_t keyframe = reader.NextKeyframe();
      if (i == next) {
        visit(keyframe, reader.Signature(i));
        next += stride;
      }
    }
    // From the last to the first.
    size_t position = num_packed + num_waiting;
    for (uint32_t i = newest_[word]; i != kNone; i = waiting_[i].older) {
      if (--position % stride == phase % stride) {
        visit(waiting_[i].keyframe, waiting_[i].signature);
      }
    }
  }

 private:
  static constexpr uint32_t kNone = ~uint32_t{0};

  struct Waiting {
    int32_t keyframe = 0;
    uint32_t signature = 0;
    uint32_t older = kNone;  // of the same word
  };

  // Of one word's packed list.
  class Reader {
   public:
    Reader(const uint8_t* begin, const uint8_t* end) : at_(begin) {
      count_ = begin == end ? 0 : NextNumber();
      newest_ = begin == end ? 0 : static_cast<int32_t>(NextNumber());
      signatures_ = end - sizeof(uint32_t) * count_;
    }
    size_t count() const { return count_; }
    int32_t newest() const { return newest_; }
    int32_t NextKeyframe() {
      keyframe_ += static_cast<int32_t>(NextNumber());
      return keyframe_;
    }
    uint32_t Signature(size_t i) const {
      uint32_t signature = 0;
      std::memcpy(&signature, signatures_ + sizeof(signature) * i, sizeof(signature));
      return signature;
    }
    // Of the gaps, when no keyframe was asked for.
    const uint8_t* gaps() const { return at_; }
    const uint8_t* signatures() const { return signatures_; }

   private:
    uint32_t NextNumber() {
      uint32_t number = *at_ & 0x7f;
      for (int shift = 7; (*at_++ & 0x80) != 0; shift += 7) {
        number |= static_cast<uint32_t>(*at_ & 0x7f) << shift;
      }
      return number;
    }

    const uint8_t* at_;
    const uint8_t* signatures_ = nullptr;
    size_t count_ = 0;
    int32_t newest_ = 0;
    int32_t keyframe_ = 0;
  };

  size_t CountWaiting(uint32_t word) const {
    size_t count = 0;
    for (uint32_t i = newest_[word]; i != kNone; i = waiting_[i].older) {
      ++count;
    }
    return count;
  }
  void PackWord(uint32_t word, std::vector<uint8_t>* packed) const;

  std::vector<uint8_t> packed_;
  size_t num_packed_ = 0;
  std::vector<uint32_t> begin_;  // of each word's list in packed_; and the end
  std::vector<Waiting> waiting_;
  std::vector<uint32_t> newest_;  // of each word, in waiting_
};

}  // namespace pangea

#pragma once

// The postings of one table of the index, by word, in little more than their signatures.
//
// All but the newest are packed: sorted by word and keyframe they are one Elias-Fano sequence
// (Elias, JACM 1974; for inverted indices Vigna, WSDM 2013). Of each posting's keyframe the lowest
// kLowBits lie in an array, beside the signatures. The rest is a bit string: for each word
// `num_spans_` zeros, one for each span of 2^kLowBits keyframes, and before the zero of a span a
// one for each posting in it. So the i-th one is where i + the zeros before it says, and where a
// word begins is found from the nearest word in begin_ by counting zeros. The newest wait in chains
// until Pack. With n postings a keyframe, a packed one takes 5.1 bytes and 128 / n more, a waiting
// one 12; a word takes 1 to 8.
//
// Deterministic; what is visited does not depend on when Pack was called. Not thread safe.

#include <bit>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "core/byte_record.h"

namespace pangea {

class PostingLists {
 public:
  // Words are 0 .. num_words - 1.
  explicit PostingLists(size_t num_words) : PostingLists(num_words, 0, 0) {}

  // Keyframes come in ascending order.
  void Add(uint32_t word, int32_t keyframe, uint32_t signature);
  // Packs what waits. Takes the time to copy all of it: so it is worth while when much waits.
  void Pack();
  // With nothing waiting. False, and nothing has changed, if these are not the bytes of lists of so
  // many words.
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);
  size_t num_packed() const { return signatures_.size(); }
  size_t num_waiting() const { return waiting_.size(); }

  // A word's packed postings.
  struct PackedList {
    size_t bit = 0;    // where it begins in the bit string
    size_t first = 0;  // number of its first posting
    size_t count = 0;
  };
  PackedList Find(uint32_t word) const;

  // What Find and Sample will read, so that the processor has it, each some words before the next.
  void PrefetchBegin(uint32_t word) const {
    __builtin_prefetch(&begin_[BlockOf(word)]);
    __builtin_prefetch(&newest_[BlockOf(word)]);
  }
  void PrefetchBits(uint32_t word) const {
    __builtin_prefetch(high_.data() + BlockBit(BlockOf(word)) / 64);
  }
  void PrefetchList(uint32_t word, const PackedList& list) const {
    __builtin_prefetch(low_.data() + list.first);
    __builtin_prefetch(signatures_.data() + list.first);
    if (waits_[word]) {
      __builtin_prefetch(&waiting_[newest_[BlockOf(word)]]);
    }
  }

  // Calls visit(keyframe, signature), in any order, for the word's postings; of those that have
  // more than `most`, for an even sample of about this many, which `phase` rotates. `list`: what
  // Find says of the word.
  template <typename Visit>
  void Sample(uint32_t word, const PackedList& list, size_t most, size_t phase, Visit visit) const {
    const size_t count = list.count + CountWaiting(word);
    const size_t stride = 1 + count / most;
    size_t next = phase % stride;
    ForEach(list, [&](size_t i, int32_t keyframe, uint32_t signature) {
      if (i == next) {
        visit(keyframe, signature);
        next += stride;
      }
    });
    // From the last to the first.
    size_t position = count;
    ForEachWaiting(word, [&](const Waiting& posting) {
      if (--position % stride == phase % stride) {
        visit(static_cast<int32_t>(posting.keyframe), posting.signature);
      }
    });
  }

 private:
  static constexpr uint32_t kNone = ~uint32_t{0};
  static constexpr int kLowBits = 8;
  // A block has so many words, a power of two, that its part of the bit string is a cache line.
  static constexpr int kMaxBlockShift = 3;
  static constexpr size_t kBitsABlock = 512;

  struct Waiting {
    uint32_t keyframe : 28 = 0;
    uint32_t word_in_block : 4 = 0;
    uint32_t signature = 0;
    uint32_t older = kNone;  // of the same block
  };

  // With room for what is to be packed.
  PostingLists(size_t num_words, size_t num_spans, size_t num_postings);

  size_t BlockOf(size_t word) const { return word >> block_shift_; }
  uint32_t InBlock(uint32_t word) const { return word & ((1U << block_shift_) - 1); }
  size_t BlockBit(size_t block) const {
    return begin_[block] + (block << block_shift_) * num_spans_;
  }
  // The first one from this bit on.
  size_t NextOne(size_t bit) const {
    uint64_t rest = high_[bit / 64] >> (bit % 64);
    while (rest == 0) {
      bit += 64 - bit % 64;
      rest = high_[bit / 64];
    }
    return bit + std::countr_zero(rest);
  }
  // Behind so many zeros from this bit on.
  size_t SkipZeros(size_t bit, size_t zeros) const;
  // Of the word that begins at this bit.
  PackedList ListAt(size_t bit, uint32_t word) const;

  // visit(i, keyframe, signature), i from 0 on.
  template <typename Visit>
  void ForEach(const PackedList& list, Visit visit) const {
    size_t bit = list.bit;
    for (size_t i = 0; i < list.count; ++i, ++bit) {
      bit = NextOne(bit);
      const size_t span = bit - list.bit - i;
      const size_t posting = list.first + i;
      visit(i, static_cast<int32_t>(span << kLowBits | low_[posting]), signatures_[posting]);
    }
  }
  // visit(waiting), the newest first.
  template <typename Visit>
  void ForEachWaiting(uint32_t word, Visit visit) const {
    if (!waits_[word]) {
      return;
    }
    for (uint32_t i = newest_[BlockOf(word)]; i != kNone; i = waiting_[i].older) {
      if (waiting_[i].word_in_block == InBlock(word)) {
        visit(waiting_[i]);
      }
    }
  }
  size_t CountWaiting(uint32_t word) const {
    size_t count = 0;
    ForEachWaiting(word, [&count](const Waiting&) { ++count; });
    return count;
  }
  // What waits of a block, by word and age.
  using WordAndNumber = std::pair<size_t, uint32_t>;
  void ListWaiting(size_t block, std::vector<WordAndNumber>* waiting) const;
  bool IsConsistent() const;

  size_t num_words_;
  size_t num_spans_;
  int block_shift_ = kMaxBlockShift;
  std::vector<uint64_t> high_;  // the bit string
  std::vector<uint8_t> low_;    // of each packed posting, as the signatures
  std::vector<uint32_t> signatures_;
  std::vector<uint32_t> begin_;  // number of the first posting of each block of words
  std::deque<Waiting> waiting_;
  std::vector<uint32_t> newest_;  // of each block, in waiting_
  std::vector<bool> waits_;       // whether something of a word does
};

}  // namespace pangea

#pragma once

// Compressed storage of one table's postings, by word; little larger than the signatures alone.
//
// All but the newest postings are packed: sorted by word and keyframe, they form an Elias-Fano
// sequence (Elias, JACM 1974; for inverted indices Vigna, WSDM 2013). The lowest kLowBits of a
// posting's keyframe number are in an array parallel to the signatures. The upper bits are in a bit
// string: for each word it has `num_spans_` zeros, one per span of 2^kLowBits keyframes, and before
// the zero of a span a one for each posting in the span. So the i-th one is at position i + (zeros
// before it), and the start of a word is found by counting zeros from the nearest block start in
// begin_. The others wait until Pack: the newest ones in linked lists by block, the rest grouped by
// block in an array, so that a query need not follow long lists all over the memory. With n
// postings per keyframe, a packed posting takes 5.1 + 128 / n bytes, a waiting one 8 or 12; a word
// takes 1.5 to 12.
//
// Deterministic; the postings visited do not depend on when Pack is called. Not thread safe.

#include <cstdint>
#include <span>
#include <vector>

#include "core/byte_record.h"

namespace pangea {

class PostingLists {
 public:
  // Words are 0 .. num_words - 1.
  explicit PostingLists(size_t num_words) : PostingLists(num_words, 0, 0) {}

  // Call with ascending keyframes.
  void Add(uint32_t word, int32_t keyframe, uint32_t signature);
  // Packs the waiting postings. It moves all postings, so call it only when many wait.
  void Pack();
  // Save requires that no posting waits. Restore returns false, and changes nothing, if the bytes
  // are not those of PostingLists with the same number of words and keyframes 0 .. num_keyframes -
  // 1.
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader, size_t num_keyframes);
  size_t num_packed() const { return signatures_.size(); }
  size_t num_waiting() const { return grouped_.size() + linked_.size(); }

  // A word's packed postings.
  struct PackedList {
    size_t bit = 0;    // position of its first bit in the bit string
    size_t first = 0;  // number of its first posting
    size_t count = 0;
  };
  PackedList Find(uint32_t word) const;

  // Prefetch the memory that Find (first two) and Sample read; call each some words in advance.
  void PrefetchBegin(uint32_t word) const {
    __builtin_prefetch(&begin_[BlockOf(word)]);
    __builtin_prefetch(&waiting_[BlockOf(word)]);
  }
  void PrefetchBits(uint32_t word) const {
    __builtin_prefetch(high_.data() + BlockBit(BlockOf(word)) / 64);
  }
  void PrefetchList(uint32_t word, const PackedList& list) const {
    __builtin_prefetch(low_.data() + list.first);
    __builtin_prefetch(signatures_.data() + list.first);
    __builtin_prefetch(grouped_.data() + GroupBegin(BlockOf(word)));
  }

  // Calls visit(keyframe), in any order, for the word's postings with accept(signature). If the
  // word has more than `most`, considers only an evenly spaced sample of about `most`; `phase`
  // selects which. `list`: the result of Find for this word. Fast if few are accepted: only of
  // these it finds the keyframe.
  template <typename Accept, typename Visit>
  void Sample(uint32_t word, const PackedList& list, size_t most, size_t phase, Accept accept,
              Visit visit) const {
    const size_t count = list.count + CountWaiting(word);
    const size_t stride = 1 + count / most;
    size_t bit = list.bit, ones = 0;  // of the list, before `bit`
    for (size_t i = phase % stride; i < list.count; i += stride) {
      const size_t posting = list.first + i;
      if (accept(signatures_[posting])) {
        bit = SkipOnes(bit, i + 1 - ones);
        ones = i + 1;
        const size_t span = bit - list.bit - ones;
        visit(static_cast<int32_t>(span << kLowBits | low_[posting]));
      }
    }
    // Waiting postings come from the last to the first.
    size_t position = count;
    ForEachWaiting(word, [&](const Waiting& posting) {
      if (--position % stride == phase % stride && accept(posting.signature)) {
        visit(static_cast<int32_t>(posting.keyframe));
      }
    });
  }

 private:
  static constexpr uint32_t kNone = ~uint32_t{0};
  static constexpr int kLowBits = 8;
  // A block has up to 2^kMaxBlockShift words: as many as fit, with their bits, in a cache line.
  static constexpr int kMaxBlockShift = 3;
  static constexpr size_t kBitsABlock = 512;
  // In linked lists are at most this share of the number of words.
  static constexpr size_t kWordsALinked = 8;

  struct Waiting {
    uint32_t keyframe : 28 = 0;
    uint32_t word_in_block : 4 = 0;
    uint32_t signature = 0;
  };
  struct Linked {
    Waiting posting;
    uint32_t older = kNone;  // next older one in the same block
  };
  // The waiting postings of a block.
  struct WaitingOfBlock {
    uint32_t group_end = 0;   // in grouped_; the group begins at the end of the block before
    uint32_t newest = kNone;  // in linked_; newer than the whole group
  };

  // Empty, with room for `num_postings` packed postings.
  PostingLists(size_t num_words, size_t num_spans, size_t num_postings);

  // Of the present number of packed postings and spans.
  int BlockShift() const;
  size_t NumBlocks() const {
    return (num_words_ + (size_t{1} << block_shift_) - 1) >> block_shift_;
  }
  size_t BlockOf(size_t word) const { return word >> block_shift_; }
  uint32_t InBlock(uint32_t word) const { return word & ((1U << block_shift_) - 1); }
  size_t BlockBit(size_t block) const {
    return begin_[block] + (block << block_shift_) * num_spans_;
  }
  // Position after so many 0 bits or 1 bits, counted from `bit` on.
  size_t SkipZeros(size_t bit, size_t zeros) const { return Skip(~uint64_t{0}, bit, zeros); }
  size_t SkipOnes(size_t bit, size_t ones) const { return Skip(0, bit, ones); }
  // Position after so many 1 bits of the string with each limb XOR `flip`.
  size_t Skip(uint64_t flip, size_t bit, size_t ones) const;
  // The list of the word whose bits begin at `bit`.
  PackedList ListAt(size_t bit, uint32_t word) const;

  size_t GroupBegin(size_t block) const { return block == 0 ? 0 : waiting_[block - 1].group_end; }
  // Calls visit(waiting) for the block's waiting postings, the newest first.
  template <typename Visit>
  void ForEachWaitingOfBlock(size_t block, Visit visit) const {
    for (uint32_t i = waiting_[block].newest; i != kNone; i = linked_[i].older) {
      visit(linked_[i].posting);
    }
    for (size_t i = waiting_[block].group_end; i-- > GroupBegin(block);) {
      visit(grouped_[i]);
    }
  }
  template <typename Visit>
  void ForEachWaiting(uint32_t word, Visit visit) const {
    ForEachWaitingOfBlock(BlockOf(word), [&](const Waiting& posting) {
      if (posting.word_in_block == InBlock(word)) {
        visit(posting);
      }
    });
  }
  size_t CountWaiting(uint32_t word) const {
    size_t count = 0;
    ForEachWaiting(word, [&count](const Waiting&) { ++count; });
    return count;
  }
  // Moves all postings from linked_ to grouped_.
  void Group();
  void ListPacked(size_t block, std::vector<PackedList>* lists) const;
  // Moves a word's list so that its first posting is number `first`, and adds newer postings.
  void PackWord(const PackedList& list, size_t word, size_t num_spans, size_t first,
                std::span<const Waiting> newer);
  bool IsConsistent() const;
  // Whether all packed postings are of keyframes 0 .. num_keyframes - 1.
  bool IsOf(size_t num_keyframes) const;

  size_t num_words_;
  size_t num_spans_;
  int block_shift_ = kMaxBlockShift;
  std::vector<uint64_t> high_;  // the bit string
  std::vector<uint8_t> low_;    // low bits of the keyframe, by packed posting
  std::vector<uint32_t> signatures_;
  std::vector<uint32_t> begin_;          // number of the first posting of each block of words
  std::vector<WaitingOfBlock> waiting_;  // by block
  std::vector<Waiting> grouped_;
  std::vector<Linked> linked_;
};

}  // namespace pangea

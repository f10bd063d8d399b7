#pragma once

// Which keyframes share descriptors with this one: an inverted index that needs no vocabulary file.
//
// The words are locality-sensitive hashes: table t's word is a fixed random choice of kWordBits of
// the descriptor's bits (Indyk & Motwani, STOC 1998). Every posting carries a signature of 32
// other bits, so that most chance collisions are seen without touching the descriptor (Hamming
// embedding; Jegou et al., ECCV 2008). A query corner votes once for each keyframe it meets,
// weighted by log(keyframes / keyframes met), the idf of Sivic & Zisserman. The constants were
// measured: docs/decisions/place_recognition_index.md.
//
// Deterministic; no result depends on time. Memory: 19.5 kB a keyframe of 600 corners, and some
// 4 MB (posting_lists.h).

#include <array>
#include <cstdint>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe.h"
#include "place_recognition/posting_lists.h"

namespace pangea {

class DescriptorIndex {
 public:
  DescriptorIndex();

  // Keyframes are numbered in the order they come: the first Add returns 0.
  int Add(const std::vector<Corner>& corners);
  int size() const { return static_cast<int>(num_corners_.size()); }

  // Packs what waits first. Restored: false if these are not its bytes.
  void Save(ByteWriter* writer);
  bool Restore(ByteReader* reader);

  // For each keyframe how much of the query it shares: its votes as a share of what it would have
  // if every query corner met it alone, 0 .. 1.
  std::vector<float> Query(const std::vector<Corner>& corners) const;

  // Postings a query compares against; the cost of one is constant.
  int64_t CountPostings(const std::vector<Corner>& corners) const;

 private:
  static constexpr int kTables = 6;
  static constexpr int kWordBits = 18;
  static constexpr size_t kNumWords = size_t{1} << kWordBits;
  static constexpr int kSignatureBits = 32;
  static constexpr int kMaxSignatureDistance = 6;
  // Of a word met more often (a place seen thousands of times) a query compares an even sample of
  // about this many: bounds its time without forgetting the place.
  static constexpr size_t kMaxPostingsPerWord = 128;
  // After so many keyframes it is one table's turn, next time the next one's. It is packed if one
  // posting waits for so many words, and this share of what is packed, so that the work of n
  // keyframes does not grow with n squared. Not more waits, since each that does is far from the
  // next in memory.
  static constexpr int kPackEvery = 10;
  static constexpr size_t kWordsAPosting = 8;
  static constexpr size_t kPackShare = 64;

  struct Table {
    std::array<uint16_t, kWordBits> word_bits{};
    std::array<uint16_t, kSignatureBits> signature_bits{};
    PostingLists postings{kNumWords};

    uint32_t Word(const Descriptor& descriptor) const;
    uint32_t Signature(const Descriptor& descriptor) const;
  };
  // Calls visit(corner, keyframe, distance of signatures) for each posting a corner meets, corner
  // by corner.
  template <typename Visit>
  void Probe(const std::vector<Corner>& corners, Visit visit) const;

  std::array<Table, kTables> tables_;
  std::vector<int> num_corners_;  // of each keyframe
};

}  // namespace pangea

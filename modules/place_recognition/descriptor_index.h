#pragma once

// Finds the keyframes that share descriptors with a query keyframe: an inverted index that needs no
// vocabulary file.
//
// The words are locality-sensitive hashes: table t's word is a fixed random choice of kWordBits of
// the descriptor's bits (Indyk & Motwani, STOC 1998). Each posting (a corner of a stored keyframe)
// carries a signature of 32 other bits, which reveals most chance collisions without the full
// descriptor (Hamming embedding; Jegou et al., ECCV 2008). A query also visits the words with one
// bit flipped (multi-probe hashing; Lv et al., VLDB 2007), as many as a small index can afford; not
// for ORB, whose results stay as they were. A query corner votes once for each keyframe with a
// similar posting, with the weight log(number of keyframes / number of those), the idf of Sivic &
// Zisserman. The constants were chosen by measurements: docs/decisions/place_recognition_index.md.
//
// Deterministic; no result depends on time. Memory: 19.5 kB per keyframe of 600 corners, plus about
// 5 MB (posting_lists.h).

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

  // Adds a keyframe and returns its number: 0, 1, 2, ...
  int Add(const std::vector<Corner>& corners);
  int size() const { return static_cast<int>(num_corners_.size()); }

  // Save packs all waiting postings first. Restore returns false if the bytes are not those of a
  // DescriptorIndex.
  void Save(ByteWriter* writer);
  bool Restore(ByteReader* reader);

  // Returns a score in 0 .. 1 for each keyframe: its votes, divided by those it would have if every
  // query corner met this keyframe and no other.
  std::vector<float> Query(const std::vector<Corner>& corners,
                           DescriptorKind kind = DescriptorKind::kOrb) const;

  // Number of postings that a query compares with; the cost of each is constant.
  int64_t CountPostings(const std::vector<Corner>& corners) const;

 private:
  static constexpr int kTables = 6;
  static constexpr int kWordBits = 18;
  static constexpr size_t kNumWords = size_t{1} << kWordBits;
  static constexpr int kSignatureBits = 32;
  static constexpr double kMaxExpectedPostings = 1e6;  // compared by a query, about 5 ms
  static constexpr int kMaxFlipped = 6;  // bits; each costs as much as the word itself
  // If a word has more postings than this (a place seen thousands of times), a query compares with
  // an evenly spaced sample of about this many. This bounds its time without forgetting the place.
  static constexpr size_t kMaxPostingsPerWord = 128;
  // After every kPackEvery keyframes, the next table in turn is considered. It is packed if at
  // least one posting per kWordsAPosting words waits, and at least 1 / kPackShare of the packed
  // ones, so that the total work is not quadratic in the number of keyframes. More should not wait:
  // waiting postings take more memory.
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
  struct Search {
    int max_signature_distance;
    int num_flipped;  // words with one bit flipped, for each corner and table
  };
  Search SearchOf(DescriptorKind kind, size_t num_corners) const;
  // Calls visit(corner, keyframe) for each posting with the corner's word and accept(distance of
  // the signatures), corner by corner.
  template <typename Accept, typename Visit>
  void Probe(const std::vector<Corner>& corners, int num_flipped, Accept accept, Visit visit) const;

  std::array<Table, kTables> tables_;
  std::vector<int> num_corners_;  // by keyframe
  int64_t num_postings_ = 0;      // in each table
};

}  // namespace pangea

#include "place_recognition/descriptor_index.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <random>
#include <span>
#include <utility>

namespace pangea {
namespace {

uint32_t GatherBits(const Descriptor& descriptor, std::span<const uint16_t> bits) {
  uint32_t word = 0;
  for (const uint16_t bit : bits) {
    word = (word << 1) | static_cast<uint32_t>((descriptor[bit / 64] >> (bit % 64)) & 1);
  }
  return word;
}

}  // namespace

uint32_t DescriptorIndex::Table::Word(const Descriptor& descriptor) const {
  return GatherBits(descriptor, word_bits);
}

uint32_t DescriptorIndex::Table::Signature(const Descriptor& descriptor) const {
  return GatherBits(descriptor, signature_bits);
}

DescriptorIndex::DescriptorIndex() {
  std::mt19937_64 rng(20200513);
  std::array<uint16_t, kDescriptorBits> order{};
  for (Table& table : tables_) {
    std::iota(order.begin(), order.end(), uint16_t{0});
    for (size_t i = 0; i < kWordBits + kSignatureBits; ++i) {
      std::swap(order[i], order[i + rng() % (order.size() - i)]);
    }
    for (int i = 0; i < kWordBits; ++i) {
      table.word_bits[i] = order[i];
    }
    for (int i = 0; i < kSignatureBits; ++i) {
      table.signature_bits[i] = order[kWordBits + i];
    }
  }
}

int DescriptorIndex::Add(const std::vector<Corner>& corners) {
  const int keyframe = size();
  num_corners_.push_back(static_cast<int>(corners.size()));
  // First all words, then all lists: these lie far apart, and the processor fetches several at
  // once.
  std::vector<std::pair<uint32_t, uint32_t>> hashes(corners.size());
  for (Table& table : tables_) {
    std::ranges::transform(corners, hashes.begin(), [&table](const Corner& corner) {
      return std::pair(table.Word(corner.descriptor), table.Signature(corner.descriptor));
    });
    for (const auto& [word, signature] : hashes) {
      table.postings.Add(word, keyframe, signature);
    }
  }
  if (size() % kPackEvery == 0) {
    PostingLists& postings = tables_[size() / kPackEvery % kTables].postings;
    if (postings.num_waiting() >
        std::max(kNumWords / kWordsAPosting, postings.num_packed() / kPackShare)) {
      postings.Pack();
    }
  }
  return keyframe;
}

void DescriptorIndex::Save(ByteWriter* writer) {
  writer->Put(num_corners_);
  for (Table& table : tables_) {
    table.postings.Pack();
    table.postings.Save(writer);
  }
}

bool DescriptorIndex::Restore(ByteReader* reader) {
  reader->Get(&num_corners_);
  return std::ranges::all_of(tables_,
                             [reader](Table& table) { return table.postings.Restore(reader); });
}

template <typename Visit>
void DescriptorIndex::Probe(const std::vector<Corner>& corners, Visit visit) const {
  // The lists lie far apart in memory: they are fetched some words ahead.
  constexpr size_t kBeginAhead = 24, kListsAhead = 12;
  std::vector<uint32_t> words(kTables * corners.size());
  for (size_t i = 0; i < words.size(); ++i) {
    words[i] = tables_[i % kTables].Word(corners[i / kTables].descriptor);
  }
  for (size_t i = 0; i < words.size(); ++i) {
    if (const size_t ahead = i + kBeginAhead; ahead < words.size()) {
      tables_[ahead % kTables].postings.PrefetchBegin(words[ahead]);
    }
    if (const size_t ahead = i + kListsAhead; ahead < words.size()) {
      tables_[ahead % kTables].postings.PrefetchLists(words[ahead]);
    }
    const Table& table = tables_[i % kTables];
    const size_t corner = i / kTables;
    const uint32_t signature = table.Signature(corners[corner].descriptor);
    // Which corner it is rotates the sample.
    table.postings.Sample(words[i], kMaxPostingsPerWord, corner,
                          [&](int32_t keyframe, uint32_t posted) {
                            visit(corner, keyframe, std::popcount(posted ^ signature));
                          });
  }
}

std::vector<float> DescriptorIndex::Query(const std::vector<Corner>& corners) const {
  std::vector<std::vector<int32_t>> met(corners.size());
  std::vector<size_t> last_voter(size(), corners.size());
  Probe(corners, [&](size_t corner, int32_t keyframe, int distance) {
    if (last_voter[keyframe] != corner && distance <= kMaxSignatureDistance) {
      last_voter[keyframe] = corner;
      met[corner].push_back(keyframe);
    }
  });
  std::vector<float> votes(size(), 0.0f);
  const double most = std::log(1.0 + size());
  for (const std::vector<int32_t>& keyframes : met) {
    const double weight = std::log((1.0 + size()) / static_cast<double>(keyframes.size()));
    for (const int32_t keyframe : keyframes) {
      votes[keyframe] += static_cast<float>(weight);
    }
  }
  for (float& vote : votes) {
    vote /= static_cast<float>(most * std::max<double>(1.0, static_cast<double>(corners.size())));
  }
  return votes;
}

int64_t DescriptorIndex::CountPostings(const std::vector<Corner>& corners) const {
  int64_t count = 0;
  Probe(corners, [&](size_t, int32_t, int) { ++count; });
  return count;
}

}  // namespace pangea

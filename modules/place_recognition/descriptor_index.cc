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
  num_postings_ += static_cast<int64_t>(corners.size());
  // First all words, then all lists: the lists are far apart in memory, and the processor fetches
  // several at once.
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
  num_postings_ = std::accumulate(num_corners_.begin(), num_corners_.end(), int64_t{0});
  return std::ranges::all_of(
      tables_, [&](Table& table) { return table.postings.Restore(reader, num_corners_.size()); });
}

template <typename Accept, typename Visit>
void DescriptorIndex::Probe(const std::vector<Corner>& corners, int num_flipped, Accept accept,
                            Visit visit) const {
  // For each corner and table: its word, then those with one bit flipped.
  const size_t num_words = 1 + static_cast<size_t>(num_flipped);
  const size_t per_corner = kTables * num_words;
  std::vector<uint32_t> words(per_corner * corners.size());
  std::vector<uint32_t> signatures(kTables * corners.size());
  for (size_t i = 0; i < signatures.size(); ++i) {
    const Table& table = tables_[i % kTables];
    const Descriptor& descriptor = corners[i / kTables].descriptor;
    signatures[i] = table.Signature(descriptor);
    const uint32_t word = table.Word(descriptor);
    for (size_t probe = 0; probe < num_words; ++probe) {
      words[i * num_words + probe] = probe == 0 ? word : word ^ (1U << (probe - 1));
    }
  }
  std::vector<PostingLists::PackedList> lists(words.size());
  // A pipeline: each step works some words behind the previous step, so that the memory it reads
  // has been prefetched.
  constexpr size_t kStep = 16;
  for (size_t i = 0; i < words.size() + 3 * kStep; ++i) {
    const auto step = [&](size_t behind, const auto& take) {
      if (const size_t at = i - behind; i >= behind && at < words.size()) {
        take(at, tables_[at / num_words % kTables]);
      }
    };
    step(0, [&](size_t at, const Table& table) { table.postings.PrefetchBegin(words[at]); });
    step(kStep, [&](size_t at, const Table& table) { table.postings.PrefetchBits(words[at]); });
    step(2 * kStep, [&](size_t at, const Table& table) {
      lists[at] = table.postings.Find(words[at]);
      table.postings.PrefetchList(words[at], lists[at]);
    });
    step(3 * kStep, [&](size_t at, const Table& table) {
      const size_t corner = at / per_corner;
      const uint32_t signature = signatures[at / num_words];
      // The corner's index selects the phase of the sample.
      table.postings.Sample(
          words[at], lists[at], kMaxPostingsPerWord, corner,
          [&](uint32_t posted) { return accept(std::popcount(posted ^ signature)); },
          [&](int32_t keyframe) { visit(corner, keyframe); });
    });
  }
}

DescriptorIndex::Search DescriptorIndex::SearchOf(DescriptorKind kind, size_t num_corners) const {
  if (kind == DescriptorKind::kOrb) {
    return {.max_signature_distance = 6, .num_flipped = 0};
  }
  // Expected number of postings compared, if only the words themselves are visited.
  const double postings =
      static_cast<double>(num_postings_) / kNumWords * kTables * static_cast<double>(num_corners);
  const double affordable = kMaxExpectedPostings / std::max(1.0, postings) - 1;
  return {.max_signature_distance = 8,
          .num_flipped = static_cast<int>(std::clamp<double>(affordable, 0, kMaxFlipped))};
}

std::vector<float> DescriptorIndex::Query(const std::vector<Corner>& corners,
                                          DescriptorKind kind) const {
  std::vector<std::vector<int32_t>> met(corners.size());
  std::vector<size_t> last_voter(size(), corners.size());
  const Search search = SearchOf(kind, corners.size());
  const auto is_similar = [&](int distance) { return distance <= search.max_signature_distance; };
  Probe(corners, search.num_flipped, is_similar, [&](size_t corner, int32_t keyframe) {
    if (last_voter[keyframe] != corner) {
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
  const auto take_all = [](int) { return true; };
  Probe(corners, 0, take_all, [&](size_t, int32_t) { ++count; });
  return count;
}

}  // namespace pangea

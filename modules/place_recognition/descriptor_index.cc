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

void DescriptorIndex::Table::Add(const Descriptor& descriptor, int keyframe) {
  const uint32_t word = Word(descriptor);
  std::unique_ptr<Page>& page = pages[word >> kPageBits];
  if (!page) {
    page = std::make_unique<Page>();
  }
  (*page)[word % page->size()].push_back({keyframe, Signature(descriptor)});
}

const std::vector<DescriptorIndex::Posting>& DescriptorIndex::Table::Postings(
    const Descriptor& descriptor) const {
  static const std::vector<Posting> none;
  const uint32_t word = Word(descriptor);
  const std::unique_ptr<Page>& page = pages[word >> kPageBits];
  return page ? (*page)[word % page->size()] : none;
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
    table.pages.resize(size_t{1} << (kWordBits - kPageBits));
  }
}

int DescriptorIndex::Add(const std::vector<Corner>& corners) {
  const int keyframe = size();
  num_corners_.push_back(static_cast<int>(corners.size()));
  for (Table& table : tables_) {
    for (const Corner& corner : corners) {
      table.Add(corner.descriptor, keyframe);
    }
  }
  return keyframe;
}

template <typename Visit>
void DescriptorIndex::Probe(const Descriptor& descriptor, size_t phase, Visit visit) const {
  for (const Table& table : tables_) {
    const uint32_t signature = table.Signature(descriptor);
    const std::vector<Posting>& postings = table.Postings(descriptor);
    const size_t stride = 1 + postings.size() / kMaxPostingsPerWord;
    for (size_t i = phase % stride; i < postings.size(); i += stride) {
      visit(postings[i], signature);
    }
  }
}

std::vector<float> DescriptorIndex::Query(const std::vector<Corner>& corners) const {
  std::vector<float> votes(size(), 0.0f);
  std::vector<int> last_voter(size(), -1);
  std::vector<int32_t> met;
  const double most = std::log(1.0 + size());
  for (int i = 0; i < static_cast<int>(corners.size()); ++i) {
    met.clear();
    Probe(corners[i].descriptor, i, [&](const Posting& posting, uint32_t signature) {
      if (last_voter[posting.keyframe] != i &&
          std::popcount(posting.signature ^ signature) <= kMaxSignatureDistance) {
        last_voter[posting.keyframe] = i;
        met.push_back(posting.keyframe);
      }
    });
    if (met.empty()) {
      continue;
    }
    const double weight = std::log((1.0 + size()) / static_cast<double>(met.size()));
    for (const int32_t keyframe : met) {
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
  for (size_t i = 0; i < corners.size(); ++i) {
    Probe(corners[i].descriptor, i, [&](const Posting&, uint32_t) { ++count; });
  }
  return count;
}

}  // namespace pangea

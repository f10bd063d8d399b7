#include "place_recognition/posting_lists.h"

#include <algorithm>
#include <utility>

namespace pangea {
namespace {

void PutNumber(uint32_t number, std::vector<uint8_t>* bytes) {
  for (; number >= 0x80; number >>= 7) {
    bytes->push_back(static_cast<uint8_t>(number | 0x80));
  }
  bytes->push_back(static_cast<uint8_t>(number));
}

void PutSignature(uint32_t signature, std::vector<uint8_t>* bytes) {
  uint8_t raw[sizeof(signature)];
  std::memcpy(raw, &signature, sizeof(signature));
  bytes->insert(bytes->end(), std::begin(raw), std::end(raw));
}

}  // namespace

void PostingLists::Add(uint32_t word, int32_t keyframe, uint32_t signature) {
  waiting_.push_back({keyframe, signature, newest_[word]});
  newest_[word] = static_cast<uint32_t>(waiting_.size()) - 1;
}

void PostingLists::Pack() {
  // Count, newest keyframe, gap and signature of a posting, at most.
  constexpr size_t kMostBytes = 5 + 5 + 5 + sizeof(uint32_t);
  std::vector<uint8_t> packed;
  packed.reserve(packed_.size() + kMostBytes * waiting_.size());
  for (uint32_t word = 0; word < newest_.size(); ++word) {
    const auto begin = static_cast<uint32_t>(packed.size());
    if (newest_[word] == kNone) {
      packed.insert(packed.end(), packed_.begin() + begin_[word],
                    packed_.begin() + begin_[word + 1]);
    } else {
      PackWord(word, &packed);
    }
    begin_[word] = begin;
  }
  begin_.back() = static_cast<uint32_t>(packed.size());
  packed_ = std::move(packed);
  num_packed_ += waiting_.size();
  waiting_.clear();
  newest_.assign(newest_.size(), kNone);
}

void PostingLists::Save(ByteWriter* writer) const {
  writer->Put(static_cast<uint64_t>(num_packed_));
  writer->Put(begin_);
  writer->Put(packed_);
}

bool PostingLists::Restore(ByteReader* reader) {
  uint64_t num_packed = 0;
  std::vector<uint32_t> begin;
  std::vector<uint8_t> packed;
  reader->Get(&num_packed);
  reader->Get(&begin);
  reader->Get(&packed);
  if (!reader->ok() || begin.size() != begin_.size() || !std::ranges::is_sorted(begin) ||
      begin.back() != packed.size()) {
    return false;
  }
  num_packed_ = num_packed;
  begin_ = std::move(begin);
  packed_ = std::move(packed);
  waiting_.clear();
  newest_.assign(newest_.size(), kNone);
  return true;
}

void PostingLists::PackWord(uint32_t word, std::vector<uint8_t>* packed) const {
  std::vector<const Waiting*> waiting;  // oldest last
  for (uint32_t i = newest_[word]; i != kNone; i = waiting_[i].older) {
    waiting.push_back(&waiting_[i]);
  }
  const uint8_t* const end = packed_.data() + begin_[word + 1];
  Reader reader(packed_.data() + begin_[word], end);
  PutNumber(static_cast<uint32_t>(reader.count() + waiting.size()), packed);
  PutNumber(static_cast<uint32_t>(waiting.front()->keyframe), packed);
  packed->insert(packed->end(), reader.gaps(), reader.signatures());
  int32_t keyframe = reader.newest();
  for (auto it = waiting.rbegin(); it != waiting.rend(); ++it) {
    PutNumber(static_cast<uint32_t>((*it)->keyframe - keyframe), packed);
    keyframe = (*it)->keyframe;
  }
  packed->insert(packed->end(), reader.signatures(), end);
  for (auto it = waiting.rbegin(); it != waiting.rend(); ++it) {
    PutSignature((*it)->signature, packed);
  }
}

}  // namespace pangea

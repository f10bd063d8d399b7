#include "place_recognition/posting_lists.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <numeric>
#include <span>
#include <utility>

namespace pangea {
namespace {

size_t NumLimbs(size_t bits) { return (bits + 63) / 64; }

uint64_t LowestBits(size_t count) { return count < 64 ? (uint64_t{1} << count) - 1 : ~uint64_t{0}; }

// Bits `at` to `at + count - 1` of the string; count is 1 to 64.
uint64_t ReadBits(const std::vector<uint64_t>& limbs, size_t at, size_t count) {
  const size_t shift = at % 64;
  uint64_t bits = limbs[at / 64] >> shift;
  if (shift + count > 64) {
    bits |= limbs[at / 64 + 1] << (64 - shift);
  }
  return bits & LowestBits(count);
}

// Copies bits to a place at or after their own, the last first. What is around them stays.
void MoveBitsUp(size_t from, size_t to, size_t count, std::vector<uint64_t>* limbs) {
  while (count > 0) {
    const size_t piece = std::min(count, (to + count - 1) % 64 + 1);  // as it is in one limb
    count -= piece;
    const size_t shift = (to + count) % 64;
    uint64_t& limb = (*limbs)[(to + count) / 64];
    limb = (limb & ~(LowestBits(piece) << shift)) | ReadBits(*limbs, from + count, piece) << shift;
  }
}

void ClearBits(size_t at, size_t count, std::vector<uint64_t>* limbs) {
  while (count > 0) {
    const size_t piece = std::min(count, 64 - at % 64);
    (*limbs)[at / 64] &= ~(LowestBits(piece) << at % 64);
    at += piece;
    count -= piece;
  }
}

// Makes a large vector longer. It seldom needs new memory: the kernel's work for fresh pages would
// take most of Pack's time.
template <typename T>
void Lengthen(size_t size, std::vector<T>* values) {
  if (size > values->capacity()) {
    values->reserve(size + size / 32);
  }
  values->resize(size);
}

}  // namespace

PostingLists::PostingLists(size_t num_words, size_t num_spans, size_t num_postings)
    : num_words_(num_words), num_spans_(num_spans) {
  high_.resize(NumLimbs(num_postings + num_words * num_spans));
  low_.resize(num_postings);
  signatures_.resize(num_postings);
  block_shift_ = BlockShift();
  begin_.resize(NumBlocks());
  waiting_.resize(begin_.size());
}

int PostingLists::BlockShift() const {
  const size_t num_bits = num_packed() + num_words_ * num_spans_;
  int shift = kMaxBlockShift;
  while (shift > 0 && (num_bits << shift) > kBitsABlock * num_words_) {
    --shift;
  }
  return shift;
}

void PostingLists::Add(uint32_t word, int32_t keyframe, uint32_t signature) {
  uint32_t& newest = waiting_[BlockOf(word)].newest;
  Linked linked;
  linked.posting.keyframe = static_cast<uint32_t>(keyframe);
  linked.posting.word_in_block = InBlock(word) & 0xf;
  linked.posting.signature = signature;
  linked.older = newest;
  newest = static_cast<uint32_t>(linked_.size());
  linked_.push_back(linked);
  if (linked_.size() >= num_words_ / kWordsALinked) {
    Group();
  }
}

void PostingLists::Group() {
  // In place: from the last block to the first each group moves to its new place.
  size_t to = num_waiting();
  grouped_.reserve(to);  // without spare capacity
  grouped_.resize(to);
  for (size_t block = waiting_.size(); block-- > 0;) {
    const auto group_end = static_cast<uint32_t>(to);
    ForEachWaitingOfBlock(block, [&](const Waiting& posting) { grouped_[--to] = posting; });
    waiting_[block] = {group_end, kNone};
  }
  linked_.clear();
}

size_t PostingLists::Skip(uint64_t flip, size_t bit, size_t ones) const {
  if (ones == 0) {
    return bit;
  }
  uint64_t found = (high_[bit / 64] ^ flip) >> (bit % 64);
  for (size_t here = std::popcount(found); here < ones; here = std::popcount(found)) {
    ones -= here;
    bit += 64 - bit % 64;
    found = high_[bit / 64] ^ flip;
  }
  // Bisect: the wanted one is in the lower or the upper half of the remaining bits.
  for (int half = 32; half > 0; half /= 2) {
    const size_t lower = std::popcount(found & ((uint64_t{1} << half) - 1));
    if (lower < ones) {
      ones -= lower;
      found >>= half;
      bit += half;
    }
  }
  return bit + 1;
}

PostingLists::PackedList PostingLists::ListAt(size_t bit, uint32_t word) const {
  const size_t end = SkipZeros(bit, num_spans_);
  return {bit, bit - word * num_spans_, end - bit - num_spans_};
}

PostingLists::PackedList PostingLists::Find(uint32_t word) const {
  return ListAt(SkipZeros(BlockBit(BlockOf(word)), InBlock(word) * num_spans_), word);
}

void PostingLists::ListPacked(size_t block, std::vector<PackedList>* lists) const {
  lists->clear();
  const size_t begin = block << block_shift_;
  const size_t end = std::min(begin + (size_t{1} << block_shift_), num_words_);
  size_t bit = BlockBit(block);
  for (size_t word = begin; word < end; ++word) {
    lists->push_back(ListAt(bit, static_cast<uint32_t>(word)));
    bit += lists->back().count + num_spans_;
  }
}

void PostingLists::Pack() {
  Group();
  if (grouped_.empty()) {
    return;
  }
  uint32_t newest = 0;
  for (const Waiting& posting : grouped_) {
    newest = std::max<uint32_t>(newest, posting.keyframe);
  }
  const size_t num_spans = (newest >> kLowBits) + 1;
  size_t end = num_packed() + num_waiting();
  Lengthen(NumLimbs(end + num_words_ * num_spans), &high_);
  Lengthen(end, &low_);
  Lengthen(end, &signatures_);
  std::vector<uint32_t> first(num_words_);  // of each word's postings
  std::vector<Waiting> newer;
  std::vector<PackedList> lists;
  // In place: from the last word to the first each moves to its new place, which is not before its
  // old one.
  for (size_t block = begin_.size(); block-- > 0;) {
    const auto group = std::span(grouped_).subspan(GroupBegin(block),
                                                   waiting_[block].group_end - GroupBegin(block));
    ListPacked(block, &lists);
    for (size_t i = lists.size(); i-- > 0;) {
      const size_t word = (block << block_shift_) + i;
      newer.clear();
      std::ranges::copy_if(group, std::back_inserter(newer),
                           [i](const Waiting& posting) { return posting.word_in_block == i; });
      end -= lists[i].count + newer.size();
      PackWord(lists[i], word, num_spans, end, newer);
      first[word] = static_cast<uint32_t>(end);
    }
  }
  num_spans_ = num_spans;
  block_shift_ = BlockShift();
  begin_.resize(NumBlocks());
  for (size_t block = 0; block < begin_.size(); ++block) {
    begin_[block] = first[block << block_shift_];
  }
  waiting_.assign(begin_.size(), {});
  grouped_ = {};
}

void PostingLists::PackWord(const PackedList& list, size_t word, size_t num_spans, size_t first,
                            std::span<const Waiting> newer) {
  std::copy_backward(low_.begin() + list.first, low_.begin() + list.first + list.count,
                     low_.begin() + first + list.count);
  std::copy_backward(signatures_.begin() + list.first,
                     signatures_.begin() + list.first + list.count,
                     signatures_.begin() + first + list.count);
  const size_t to = first + word * num_spans;
  const size_t moved = list.count + num_spans_;
  MoveBitsUp(list.bit, to, moved, &high_);
  ClearBits(to + moved, list.count + newer.size() + num_spans - moved, &high_);
  for (size_t posting = first + list.count; const Waiting& waiting : newer) {
    const size_t bit = posting + word * num_spans + (waiting.keyframe >> kLowBits);
    high_[bit / 64] |= uint64_t{1} << (bit % 64);
    low_[posting] = static_cast<uint8_t>(waiting.keyframe);
    signatures_[posting] = waiting.signature;
    ++posting;
  }
}

void PostingLists::Save(ByteWriter* writer) const {
  writer->Put(static_cast<uint64_t>(num_spans_));
  writer->Put(high_);
  writer->Put(low_);
  writer->Put(signatures_);
  writer->Put(begin_);
}

bool PostingLists::Restore(ByteReader* reader, size_t num_keyframes) {
  uint64_t num_spans = 0;
  std::vector<uint64_t> high;
  std::vector<uint8_t> low;
  std::vector<uint32_t> signatures, begin;
  reader->Get(&num_spans);
  reader->Get(&high);
  reader->Get(&low);
  reader->Get(&signatures);
  reader->Get(&begin);
  constexpr size_t kMaxSpans = size_t{1} << 20;
  if (!reader->ok() || num_spans > kMaxSpans ||
      high.size() != NumLimbs(low.size() + num_words_ * num_spans)) {
    return false;
  }
  PostingLists restored(num_words_, num_spans, low.size());
  if (signatures.size() != low.size() || begin.size() != restored.begin_.size()) {
    return false;
  }
  restored.high_ = std::move(high);
  restored.low_ = std::move(low);
  restored.signatures_ = std::move(signatures);
  restored.begin_ = std::move(begin);
  if (!restored.IsConsistent() || !restored.IsOf(num_keyframes)) {
    return false;
  }
  *this = std::move(restored);
  return true;
}

// Checks the number of ones and zeros, and that the blocks begin where these say.
bool PostingLists::IsConsistent() const {
  const auto count_ones = [](size_t sum, uint64_t limb) { return sum + std::popcount(limb); };
  if (std::accumulate(high_.begin(), high_.end(), size_t{0}, count_ones) != num_packed()) {
    return false;
  }
  size_t bit = 0;
  for (size_t block = 0; block < begin_.size(); ++block) {
    if (BlockBit(block) != bit) {
      return false;
    }
    const size_t words = std::min(size_t{1} << block_shift_, num_words_ - (block << block_shift_));
    bit = SkipZeros(bit, words * num_spans_);
  }
  return bit == num_packed() + num_words_ * num_spans_;
}

bool PostingLists::IsOf(size_t num_keyframes) const {
  const size_t num_spans = (num_keyframes + (size_t{1} << kLowBits) - 1) >> kLowBits;
  if (num_spans_ != num_spans) {
    return num_spans_ < num_spans;
  }
  if (num_spans == 0) {
    return true;
  }
  // Only the last span may go beyond the keyframes.
  const size_t num_low = num_keyframes - ((num_spans - 1) << kLowBits);
  size_t bit = 0;
  for (size_t word = 0; word < num_words_; ++word) {
    const size_t last_span = SkipZeros(bit, num_spans - 1);
    bit = SkipZeros(last_span, 1);
    const size_t zeros = word * num_spans + num_spans - 1;
    if (std::any_of(low_.begin() + static_cast<ptrdiff_t>(last_span - zeros),
                    low_.begin() + static_cast<ptrdiff_t>(bit - 1 - zeros),
                    [num_low](uint8_t low) { return low >= num_low; })) {
      return false;
    }
  }
  return true;
}

}  // namespace pangea

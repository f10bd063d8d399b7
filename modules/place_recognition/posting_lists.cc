#include "place_recognition/posting_lists.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace pangea {
namespace {

size_t NumLimbs(size_t bits) { return (bits + 63) / 64; }

}  // namespace

PostingLists::PostingLists(size_t num_words, size_t num_spans, size_t num_postings)
    : num_words_(num_words), num_spans_(num_spans) {
  const size_t num_bits = num_postings + num_words * num_spans;
  while (block_shift_ > 0 && (num_bits << block_shift_) > kBitsABlock * num_words) {
    --block_shift_;
  }
  high_.resize(NumLimbs(num_bits));
  low_.resize(num_postings);
  signatures_.resize(num_postings);
  begin_.resize((num_words + (size_t{1} << block_shift_) - 1) >> block_shift_);
  newest_.resize(begin_.size(), kNone);
  waits_.resize(num_words);
}

void PostingLists::Add(uint32_t word, int32_t keyframe, uint32_t signature) {
  uint32_t& newest = newest_[BlockOf(word)];
  waits_[word] = true;
  Waiting waiting;
  waiting.keyframe = static_cast<uint32_t>(keyframe);
  waiting.word_in_block = InBlock(word) & 0xf;
  waiting.signature = signature;
  waiting.older = newest;
  waiting_.push_back(waiting);
  newest = static_cast<uint32_t>(waiting_.size()) - 1;
}

size_t PostingLists::SkipZeros(size_t bit, size_t zeros) const {
  if (zeros == 0) {
    return bit;
  }
  uint64_t found = ~high_[bit / 64] >> (bit % 64);
  for (size_t here = std::popcount(found); here < zeros; here = std::popcount(found)) {
    zeros -= here;
    bit += 64 - bit % 64;
    found = ~high_[bit / 64];
  }
  // Bisect: the wanted zero is in the lower or the upper half of the remaining bits.
  for (int half = 32; half > 0; half /= 2) {
    const size_t lower = std::popcount(found & ((uint64_t{1} << half) - 1));
    if (lower < zeros) {
      zeros -= lower;
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

void PostingLists::ListWaiting(size_t block, std::vector<WordAndNumber>* waiting) const {
  waiting->clear();
  for (uint32_t i = newest_[block]; i != kNone; i = waiting_[i].older) {
    waiting->emplace_back((block << block_shift_) + waiting_[i].word_in_block, i);
  }
  std::ranges::sort(*waiting);
}

void PostingLists::Pack() {
  if (waiting_.empty()) {
    return;
  }
  PostingLists packed(num_words_, (waiting_.back().keyframe >> kLowBits) + 1,
                      num_packed() + num_waiting());
  size_t made = 0, blocks_begun = 0;
  const auto put = [&](size_t word, size_t keyframe, uint32_t signature) {
    for (; blocks_begun << packed.block_shift_ <= word; ++blocks_begun) {
      packed.begin_[blocks_begun] = static_cast<uint32_t>(made);
    }
    const size_t bit = made + word * packed.num_spans_ + (keyframe >> kLowBits);
    packed.high_[bit / 64] |= uint64_t{1} << (bit % 64);
    packed.low_[made] = static_cast<uint8_t>(keyframe);
    packed.signatures_[made] = signature;
    ++made;
  };
  size_t next = 0, bit = 0, word = 0;
  std::vector<WordAndNumber> waiting;
  for (size_t block = 0; block < begin_.size(); ++block) {
    ListWaiting(block, &waiting);
    auto newer = waiting.begin();
    const auto put_newer_before = [&](size_t end_word) {
      for (; newer != waiting.end() && newer->first < end_word; ++newer) {
        const Waiting& posting = waiting_[newer->second];
        put(newer->first, posting.keyframe, posting.signature);
      }
    };
    const size_t end = block + 1 < begin_.size() ? begin_[block + 1] : num_packed();
    for (; next < end; ++next, ++bit) {
      bit = NextOne(bit);
      while (bit - next >= (word + 1) * num_spans_) {
        ++word;
      }
      put_newer_before(word);
      const size_t span = bit - next - word * num_spans_;
      put(word, span << kLowBits | low_[next], signatures_[next]);
    }
    put_newer_before(num_words_);
  }
  std::fill(packed.begin_.begin() + static_cast<ptrdiff_t>(blocks_begun), packed.begin_.end(),
            static_cast<uint32_t>(made));
  *this = std::move(packed);
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

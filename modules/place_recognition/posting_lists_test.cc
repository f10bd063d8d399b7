#include "place_recognition/posting_lists.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <utility>

namespace pangea {
namespace {

using Postings = std::vector<std::pair<int32_t, uint32_t>>;

// One signature in `of` is accepted.
Postings Visited(const PostingLists& lists, uint32_t word, size_t most, size_t phase, uint32_t of) {
  Postings visited;
  uint32_t accepted = 0;
  lists.Sample(
      word, lists.Find(word), most, phase,
      [&](uint32_t signature) {
        accepted = signature;
        return signature % of == 0;
      },
      [&](int32_t keyframe) { visited.emplace_back(keyframe, accepted); });
  std::ranges::sort(visited);
  return visited;
}

// The expected result, from plain lists.
Postings Expected(const Postings& list, size_t most, size_t phase, uint32_t of) {
  Postings expected;
  const size_t stride = 1 + list.size() / most;
  for (size_t i = phase % stride; i < list.size(); i += stride) {
    if (list[i].second % of == 0) {
      expected.push_back(list[i]);
    }
  }
  std::ranges::sort(expected);
  return expected;
}

// Few words, so that lists are long; keyframes next to each other and far apart.
TEST(PostingLists, VisitsWhatPlainListsWouldWheneverItIsPacked) {
  constexpr uint32_t kWords = 80;
  std::mt19937_64 rng(1);
  for (const int pack_every : {1, 7, 50, 1000}) {
    PostingLists lists(kWords);
    std::map<uint32_t, Postings> plain;
    int32_t keyframe = 0;
    for (int n = 0; n < 120; ++n) {
      for (int i = 0; i < 30; ++i) {
        const auto word = static_cast<uint32_t>(rng() % (kWords - 1));  // the last has none
        const auto signature = static_cast<uint32_t>(rng());
        lists.Add(word, keyframe, signature);
        plain[word].emplace_back(keyframe, signature);
      }
      keyframe += static_cast<int32_t>(1 + rng() % (1ULL << (n % 16)));
      if (n % pack_every == 0) {
        lists.Pack();
      }
      for (uint32_t word = 0; word < kWords; ++word) {
        for (const size_t most : {1000, 10, 3}) {
          for (const uint32_t of : {1, 5}) {
            ASSERT_EQ(Visited(lists, word, most, n, of), Expected(plain[word], most, n, of));
          }
        }
      }
    }
  }
}

// The packed postings do not depend on how often they were packed: they are moved in place.
TEST(PostingLists, AreTheSameHoweverOftenTheyWerePacked) {
  constexpr uint32_t kWords = 1000;  // of several blocks, the last of them not full
  const auto saved = [](int pack_every) {
    PostingLists lists(kWords);
    std::mt19937_64 rng(2);
    for (int keyframe = 0; keyframe < 3000; ++keyframe) {
      for (int i = 0; i < 30; ++i) {
        const auto word = static_cast<uint32_t>(std::min(rng() % kWords, rng() % kWords));
        lists.Add(word, keyframe, static_cast<uint32_t>(rng()));
      }
      if (keyframe % pack_every == 0) {
        lists.Pack();
      }
    }
    lists.Pack();
    ByteRecordWriter writer;
    lists.Save(&writer);
    return writer.Take();
  };
  const std::vector<uint8_t> once = saved(3000);
  for (const int pack_every : {1, 10, 256, 999}) {
    EXPECT_TRUE(saved(pack_every) == once) << pack_every;
  }
}

// A query counts votes by keyframe: a number that no keyframe has would be outside of its memory.
TEST(PostingLists, AreNotRestoredWithPostingsOfOtherKeyframes) {
  constexpr uint32_t kWords = 12;
  for (const size_t num_keyframes : {1, 256, 257, 600}) {
    PostingLists lists(kWords);
    for (size_t keyframe = 0; keyframe < num_keyframes; ++keyframe) {
      lists.Add(static_cast<uint32_t>(keyframe % kWords), static_cast<int32_t>(keyframe), 7);
    }
    lists.Pack();
    ByteRecordWriter writer;
    lists.Save(&writer);
    const std::vector<uint8_t> bytes = writer.Take();
    const auto restores = [&bytes](size_t keyframes) {
      ByteRecordReader reader(bytes);
      return PostingLists(kWords).Restore(&reader, keyframes);
    };
    EXPECT_TRUE(restores(num_keyframes)) << num_keyframes;
    EXPECT_TRUE(restores(num_keyframes + 300)) << "the others have no corners";
    EXPECT_FALSE(restores(num_keyframes - 1)) << num_keyframes;
    EXPECT_FALSE(restores(0)) << num_keyframes;
  }
}

}  // namespace
}  // namespace pangea

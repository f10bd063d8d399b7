#include "link/anchor_wire.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "messages/encoding.h"
#include "messages/testing/test_anchors.h"

namespace pangea {
namespace {

constexpr int64_t kLargest = std::numeric_limits<int64_t>::max();

TEST(AnchorWire, EditRoundTrip) {
  const AnchorEdit edit = TestEdit({2, 77}, 3, 2);
  const auto parsed = ParseAnchorEdit(2, EncodeAnchorEdit(edit));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(EncodeAnchorEdit(*parsed.value), EncodeAnchorEdit(edit));
  EXPECT_EQ(ParseAnchorEdit(3, EncodeAnchorEdit(edit)).refused, "anchor edit of another agent");
}

TEST(AnchorWire, AnchorRoundTrip) {
  const AnchorState state = TestAnchor({5, 77}, 3, {2, 100});
  const std::vector<uint8_t> message = EncodeMessage(ToMessage(state));
  const auto parsed = ParseAnchor(2, EncodeAnchor(1 << 20, message));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->number, 1 << 20);
  EXPECT_EQ(EncodeMessage(ToMessage(parsed.value->state)), message);
  EXPECT_EQ(ParseAnchor(3, EncodeAnchor(1, message)).refused, "anchor in another agent's map");
  EXPECT_FALSE(ParseAnchor(2, EncodeAnchor(0, message)).value);
}

TEST(AnchorWire, NumbersAndAnswersRoundTrip) {
  const std::vector<int64_t> numbers = {1, 300, kLargest};
  EXPECT_EQ(ParseAnchorsReceived(EncodeAnchorsReceived(numbers)).value, numbers);
  const auto answers =
      ParseAnchorEditAnswers(EncodeAnchorEditAnswers({{{2, 77}, 3, true}, {{65535, 1}, 9, false}}));
  ASSERT_TRUE(answers.value);
  ASSERT_EQ(answers.value->size(), 2u);
  EXPECT_EQ(answers.value->at(0).anchor, (AnchorId{2, 77}));
  EXPECT_TRUE(answers.value->at(0).journalled);
  EXPECT_EQ(answers.value->at(1).revision, 9);
  EXPECT_FALSE(answers.value->at(1).journalled);
}

TEST(AnchorWire, TheLargestFitAnEthernetFrame) {
  AnchorEdit edit = TestEdit({65535, kLargest >> 4}, kLargest >> 4, 65535);
  edit.name.assign(kMaxAnchorName, 'n');
  edit.payload.assign(kMaxAnchorPayload, 'p');
  AnchorState state = TestAnchor(edit.anchor, edit.revision, {65535, 1});
  state.name = edit.name;
  state.payload = edit.payload;
  const std::vector<uint8_t> message = EncodeMessage(ToMessage(state));
  EXPECT_LE(EncodeAnchorEdit(edit).size(), size_t{kMaxAnchorBytes});
  EXPECT_TRUE(ParseAnchorEdit(65535, EncodeAnchorEdit(edit)).value);
  EXPECT_TRUE(ParseAnchor(65535, EncodeAnchor(kLargest, message)).value);
  EXPECT_LE(EncodeAnchor(kLargest, message).size(), size_t{kFramePayloadBytes});
  const std::vector<int64_t> numbers(kMaxAnchorsReceived, kLargest);
  EXPECT_LE(EncodeAnchorsReceived(numbers).size(), size_t{kFramePayloadBytes});
  const std::vector<AnchorEditAnswer> answers(kMaxAnchorEditAnswers, {edit.anchor, kLargest, true});
  EXPECT_LE(EncodeAnchorEditAnswers(answers).size(), size_t{kFramePayloadBytes});
  EXPECT_TRUE(ParseAnchorEditAnswers(EncodeAnchorEditAnswers(answers)).value);
}

TEST(AnchorWire, TooManyAreRefused) {
  const std::vector<int64_t> numbers(kMaxAnchorsReceived + 1, 1);
  EXPECT_FALSE(ParseAnchorsReceived(EncodeAnchorsReceived(numbers)).value);
  const std::vector<AnchorEditAnswer> answers(kMaxAnchorEditAnswers + 1, {{1, 2}, 3, true});
  EXPECT_FALSE(ParseAnchorEditAnswers(EncodeAnchorEditAnswers(answers)).value);
}

TEST(AnchorWire, DamagedBodiesAreRefusedOrBounded) {
  const std::vector<std::vector<uint8_t>> bodies = {
      EncodeAnchorEdit(TestEdit({2, 77}, 3, 2)),
      EncodeAnchor(5, EncodeMessage(ToMessage(TestAnchor({2, 77}, 3, {2, 100})))),
      EncodeAnchorsReceived({1, 300, 70'000}),
      EncodeAnchorEditAnswers({{{2, 77}, 3, true}, {{3, 1}, 9, false}})};
  std::mt19937_64 rng(4);
  for (int i = 0; i < 20'000; ++i) {
    std::vector<uint8_t> body = bodies[rng() % bodies.size()];
    for (int flips = static_cast<int>(rng() % 4); flips >= 0; --flips) {
      body[rng() % body.size()] ^= static_cast<uint8_t>(1 + rng() % 255);
    }
    body.resize(rng() % 3 == 0 ? rng() % (2 * body.size()) : body.size());
    if (const auto edit = ParseAnchorEdit(2, body); edit.value) {
      EXPECT_EQ(edit.value->agent_id, 2);
      EXPECT_GE(edit.value->revision, 1);
    }
    if (const auto anchor = ParseAnchor(2, body); anchor.value) {
      EXPECT_GE(anchor.value->number, 1);
      EXPECT_TRUE(anchor.value->state.T_odom_anchor.t.allFinite());
    }
    if (const auto numbers = ParseAnchorsReceived(body); numbers.value) {
      EXPECT_LE(numbers.value->size(), kMaxAnchorsReceived);
    }
    if (const auto answers = ParseAnchorEditAnswers(body); answers.value) {
      EXPECT_LE(answers.value->size(), kMaxAnchorEditAnswers);
    }
  }
}

}  // namespace
}  // namespace pangea

#include "posegraph/graph/received_constraints.h"

#include <gtest/gtest.h>

#include <set>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

const MapId kMap = RowId(1);

// Uses constraints on known keyframes.
struct User {
  bool operator()(const Constraint& constraint) {
    const bool known = seqs.contains(constraint.from.seq) && seqs.contains(constraint.to.seq);
    num_used += known ? 1 : 0;
    return known;
  }
  std::set<int> seqs;
  int num_used = 0;
};

TEST(ReceivedConstraints, EachIsUsedOnceAndARefusalNever) {
  User user{{1, 2}};
  ReceivedConstraints received;
  Constraint constraint = MakeConstraint({kMap, 1}, {kMap, 2}, {});
  constraint.accepted = false;
  received.Add(constraint, std::ref(user));
  EXPECT_EQ(user.num_used, 0);
  constraint.accepted = true;
  received.Add(constraint, std::ref(user));
  received.Add(constraint, std::ref(user));
  EXPECT_EQ(user.num_used, 1);
  EXPECT_EQ(received.num_waiting(), 0u);
}

TEST(ReceivedConstraints, OneWaitsForBothItsKeyframes) {
  User user;
  ReceivedConstraints received;
  received.Add(MakeConstraint({kMap, 1}, {kMap, 2}, {}), std::ref(user));
  received.Add(MakeConstraint({kMap, 1}, {kMap, 2}, {}), std::ref(user));
  received.Add(MakeConstraint({kMap, 1}, {kMap, 3}, {}), std::ref(user));
  EXPECT_EQ(received.num_waiting(), 2u);
  user.seqs = {1};
  received.KeyframeCame({kMap, 1}, std::ref(user));
  EXPECT_EQ(received.num_waiting(), 2u);
  user.seqs = {1, 2, 3};
  received.KeyframeCame({kMap, 2}, std::ref(user));
  EXPECT_EQ(user.num_used, 1);  // the other one is about seq 3
  EXPECT_EQ(received.num_waiting(), 1u);
  received.Add(MakeConstraint({kMap, 1}, {kMap, 2}, {}), std::ref(user));
  EXPECT_EQ(user.num_used, 1);
}

TEST(ReceivedConstraints, BeyondTheBoundOneMayComeAgain) {
  User user;
  ReceivedConstraints received;
  const auto add = [&](int seq) {
    received.Add(MakeConstraint({kMap, 0}, {kMap, seq}, {}), std::ref(user));
  };
  const auto bound = static_cast<int>(ReceivedConstraints::kMaxWaiting);
  for (int seq = 1; seq <= bound + 1; ++seq) {
    add(seq);
  }
  EXPECT_EQ(received.num_waiting(), ReceivedConstraints::kMaxWaiting);
  user.seqs = {0, bound, bound + 1};
  add(bound);  // waits
  EXPECT_EQ(user.num_used, 0);
  add(bound + 1);  // was forgotten
  EXPECT_EQ(user.num_used, 1);
}

TEST(ReceivedConstraints, AreTheSameAfterACheckpoint) {
  User user{{1, 2}};
  ReceivedConstraints received;
  received.Add(MakeConstraint({kMap, 1}, {kMap, 2}, {}), std::ref(user));
  received.Add(MakeConstraint({kMap, 1}, {kMap, 3}, {}), std::ref(user));
  const std::vector<uint8_t> bytes = BytesOf(received);
  ReceivedConstraints restored;
  ByteRecordReader reader(bytes);
  ASSERT_TRUE(restored.Restore(&reader));
  EXPECT_TRUE(reader.at_end());
  EXPECT_EQ(BytesOf(restored), bytes);
  restored.Add(MakeConstraint({kMap, 1}, {kMap, 2}, {}), std::ref(user));
  EXPECT_EQ(user.num_used, 1);
  user.seqs.insert(3);
  restored.KeyframeCame({kMap, 3}, std::ref(user));
  EXPECT_EQ(user.num_used, 2);

  ByteRecordReader half(std::span<const uint8_t>(bytes).first(bytes.size() / 2));
  EXPECT_FALSE(ReceivedConstraints().Restore(&half));
}

}  // namespace
}  // namespace pangea

#include "global_ba/global_ba.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "global_ba/ba_test_world.h"

namespace pangea {
namespace {

struct Adjuster {
  explicit Adjuster(const BaTestMessages& messages, std::shared_ptr<RecordStore> records = nullptr)
      : ba(GlobalBaOptions{}, std::move(records)) {
    for (const Keyframe& keyframe : messages.keyframes) {
      ba.Take(keyframe);
    }
    for (const PlaceMatch& match : messages.matches) {
      ba.Take(match);
    }
    for (const Constraint& constraint : messages.constraints) {
      ba.Take(constraint);
    }
    ba.Take(messages.state);
  }

  std::optional<MapState> Finish() {
    while (ba.HasWork()) {
      if (auto refined = ba.Advance()) {
        return refined;
      }
    }
    return std::nullopt;
  }

  GlobalBa ba;
};

BaWorld Moved(BaWorld world, const MapState& refined) {
  for (size_t i = 0; i < world.keyframes.size(); ++i) {
    EXPECT_EQ(world.keyframes[i].id, refined.keyframes[i].id);
    world.keyframes[i].state.T_map_body = refined.keyframes[i].T_map_body;
  }
  return world;
}

TEST(GlobalBa, RefinesAGroup) {
  const BaTestWorld world = MakeBaTestWorld({});
  const auto refined = Adjuster(MessagesOf(world)).Finish();
  ASSERT_TRUE(refined.has_value());
  EXPECT_EQ(refined->revision, 1);
  const double before = WorstError(world.start, world.truth);
  EXPECT_GT(before, 0.1);
  EXPECT_LT(WorstError(Moved(world.start, *refined), world.truth), 0.2 * before);
}

// An agent with its own odometry has no preintegrations. Its edges are metric; the start is not.
TEST(GlobalBa, WithoutInertialMeasurementsTheEdgesGiveTheScale) {
  for (const uint64_t seed : {1, 2, 3}) {
    const BaTestWorld world =
        MakeBaTestWorld({.seed = seed, .keyframes = 40, .edge_sigma_m = 0.002, .imu = false});
    const double true_length = PathLength(world.truth);
    ASSERT_NEAR(PathLength(world.start) / true_length, 1.02, 5e-3);
    const auto refined = Adjuster(MessagesOf(world)).Finish();
    ASSERT_TRUE(refined.has_value());
    const BaWorld moved = Moved(world.start, *refined);
    EXPECT_NEAR(PathLength(moved) / true_length, 1, 2e-3);
    EXPECT_LT(WorstError(moved, world.truth), 0.2 * WorstError(world.start, world.truth));
  }
}

// Edges of any claimed accuracy, such as those of a simulator, must not outweigh the rounding of
// all else.
TEST(GlobalBa, AnOdometryThatCallsItselfExactDoesNoHarm) {
  const BaTestWorld world = MakeBaTestWorld({.edge_sigma_m = 0.002});
  for (const double variance : {1e-12, 1e-18, 1e-310}) {
    BaTestMessages messages = MessagesOf(world);
    for (size_t i = 1; i < messages.keyframes.size(); ++i) {
      Keyframe& keyframe = messages.keyframes[i];
      if (keyframe.edge && keyframe.id.map.agent_id == 2) {
        keyframe.edge->T_from_this = world.truth.keyframes[i - 1].state.T_map_body.Inverse() *
                                     world.truth.keyframes[i].state.T_map_body;
        keyframe.edge->covariance = variance * Matrix6d::Identity();
      }
    }
    const auto refined = Adjuster(messages).Finish();
    ASSERT_TRUE(refined);
    EXPECT_LT(WorstError(Moved(world.start, *refined), world.truth),
              0.2 * WorstError(world.start, world.truth))
        << variance;
  }
}

// Nothing but its edges says where a keyframe is that sees no landmark.
TEST(GlobalBa, AKeyframeWithoutLandmarksMovesWithItsEdges) {
  BaTestWorld world = MakeBaTestWorld({.edge_sigma_m = 0.002, .imu = false});
  std::erase_if(world.start.observations, [&](const BaObservation& seen) {
    return world.start.keyframes[seen.keyframe].id == KeyframeId{{2, 1000}, 10};
  });
  const auto refined = Adjuster(MessagesOf(world)).Finish();
  ASSERT_TRUE(refined.has_value());
  EXPECT_LT(WorstError(Moved(world.start, *refined), world.truth),
            0.2 * WorstError(world.start, world.truth));
}

// After an earlier adjustment, the initial poses differ, and so do the landmarks at first.
TEST(GlobalBa, WhereItBeginsDoesNotMatter) {
  for (const uint64_t seed : {1, 2, 3}) {
    const BaTestWorld world = MakeBaTestWorld({.seed = seed});
    BaTestMessages messages = MessagesOf(world);
    const auto from_odometry = Adjuster(messages).Finish();
    ASSERT_TRUE(from_odometry);
    messages.state.keyframes = from_odometry->keyframes;
    const auto from_adjusted = Adjuster(messages).Finish();
    ASSERT_TRUE(from_adjusted);
    EXPECT_LT(WorstError(Moved(world.start, *from_odometry), Moved(world.start, *from_adjusted)),
              1e-4);
  }
}

TEST(GlobalBa, TheOrderOfMessagesDoesNotMatter) {
  BaTestMessages messages = MessagesOf(MakeBaTestWorld({.keyframes = 8}));
  const auto in_order = Adjuster(messages).Finish();
  std::mt19937_64 rng(1);
  std::ranges::shuffle(messages.keyframes, rng);
  std::ranges::shuffle(messages.matches, rng);
  std::ranges::shuffle(messages.constraints, rng);
  const auto shuffled = Adjuster(messages).Finish();
  ASSERT_TRUE(in_order && shuffled);
  for (size_t i = 0; i < in_order->keyframes.size(); ++i) {
    EXPECT_EQ(in_order->keyframes[i].T_map_body.t, shuffled->keyframes[i].T_map_body.t);
  }
}

class CountingStore : public RecordStore {
 public:
  std::optional<int64_t> Append(std::span<const uint8_t> record) override {
    const auto offset = static_cast<int64_t>(bytes_.size());
    bytes_.insert(bytes_.end(), record.begin(), record.end());
    return offset;
  }
  bool Read(int64_t offset, std::span<uint8_t> record) override {
    ++num_reads_;
    std::copy_n(bytes_.begin() + offset, record.size(), record.begin());
    return true;
  }
  std::string problem() const override { return ""; }
  int num_reads() const { return num_reads_; }

 private:
  std::vector<uint8_t> bytes_;
  int num_reads_ = 0;
};

// Otherwise the cost of an adjustment would grow with the number of groups on the server.
TEST(GlobalBa, NothingIsReadOfOtherGroups) {
  const BaTestMessages group = MessagesOf(MakeBaTestWorld({.keyframes = 8}));
  const auto alone = std::make_shared<CountingStore>();
  ASSERT_TRUE(Adjuster(group, alone).Finish());
  const auto beside_another = std::make_shared<CountingStore>();
  Adjuster server(group, beside_another);
  constexpr int32_t kOthers = 100;
  for (PlaceMatch match : group.matches) {
    match.query.map.agent_id += kOthers;
    for (PlaceCandidate& candidate : match.candidates) {
      candidate.match.map.agent_id += kOthers;
    }
    server.ba.Take(match);
  }
  for (Constraint constraint : group.constraints) {
    constraint.from.map.agent_id += kOthers;
    constraint.to.map.agent_id += kOthers;
    server.ba.Take(constraint);
  }
  ASSERT_TRUE(server.Finish());
  EXPECT_EQ(beside_another->num_reads(), alone->num_reads());
}

// A redundant candidate, which was not verified, still adds observations; a refused one does not.
TEST(GlobalBa, RedundantMatchesTieLandmarks) {
  BaTestMessages messages = MessagesOf(MakeBaTestWorld({.keyframes = 8}));
  const auto accepted = Adjuster(messages).Finish();
  const auto with_reason = [&](const std::string& reason) {
    for (Constraint& constraint : messages.constraints) {
      constraint.accepted = false;
      constraint.reason = reason;
    }
    return Adjuster(messages).Finish();
  };
  const auto redundant = with_reason(kRedundant);
  const auto refused = with_reason("too few inliers");
  ASSERT_TRUE(accepted && redundant && refused);
  const auto newest = [](const MapState& state) { return state.keyframes.back().T_map_body.t; };
  EXPECT_EQ(newest(*accepted), newest(*redundant));
  EXPECT_NE(newest(*accepted), newest(*refused));
}

TEST(GlobalBa, AMessageOfTheGroupDropsTheWorkAndOtherMessagesDoNot) {
  const BaTestMessages messages = MessagesOf(MakeBaTestWorld({.keyframes = 8}));
  Adjuster server(messages);
  server.ba.Advance();
  server.ba.Advance();
  Keyframe elsewhere = messages.keyframes.front();
  elsewhere.id.map = {9, 9};
  server.ba.Take(elsewhere);
  server.ba.Take(messages.keyframes.front());    // a repeat
  server.ba.Take(messages.constraints.front());  // another constraint
  EXPECT_EQ(server.ba.counters().dropped, 0);
  Keyframe next = messages.keyframes.back();
  ++next.id.seq;
  server.ba.Take(next);
  EXPECT_EQ(server.ba.counters().dropped, 1);
  EXPECT_TRUE(server.Finish().has_value());
  EXPECT_EQ(server.ba.counters().begun, 2);
}

TEST(GlobalBa, AGroupIsDueAgainWhenItsLoopsOrKeyframesChange) {
  const BaTestMessages messages = MessagesOf(MakeBaTestWorld({.keyframes = 8}));
  Adjuster server(messages);
  const auto refined = server.Finish();
  ASSERT_TRUE(refined.has_value());
  MapState state = *refined;
  ++state.revision;  // as published by the pose graph after the refinement, in another frame
  for (KeyframePose& pose : state.keyframes) {
    pose.T_map_body = Rigid3(YawRotation(1), {1, 2, 3}) * pose.T_map_body;
  }
  server.ba.Take(state);
  EXPECT_FALSE(server.ba.HasWork());
  ++state.revision;
  ++state.num_constraints;
  server.ba.Take(state);
  EXPECT_TRUE(server.ba.HasWork());
}

TEST(GlobalBa, AGroupIsDueAgainWhenThePoseGraphHasForgotten) {
  const BaTestMessages messages = MessagesOf(MakeBaTestWorld({.keyframes = 8}));
  Adjuster server(messages);
  ASSERT_TRUE(server.Finish().has_value());
  MapState state = messages.state;
  ++state.revision;
  server.ba.Take(state);
  EXPECT_TRUE(server.Finish().has_value());
}

TEST(GlobalBa, AStateThatComesLateChangesNothing) {
  const BaTestMessages messages = MessagesOf(MakeBaTestWorld({.keyframes = 8}));
  Adjuster server(messages);
  MapState refined = *server.Finish();
  refined.revision = 3;
  server.ba.Take(refined);
  MapState late = messages.state;
  late.revision = 2;
  server.ba.Take(late);
  EXPECT_FALSE(server.ba.HasWork());
}

TEST(GlobalBa, AMapWithoutLoopsIsNotDue) {
  BaTestMessages messages = MessagesOf(MakeBaTestWorld({.agents = 1}));
  EXPECT_EQ(messages.state.num_constraints, 0);
  EXPECT_FALSE(Adjuster(messages).ba.HasWork());
}

// The maps have been separated since: the state of both is outdated.
TEST(GlobalBa, AGroupThatIsNoMoreIsNotDue) {
  const BaTestMessages messages = MessagesOf(MakeBaTestWorld({.keyframes = 8}));
  Adjuster server(messages);
  for (const MapId& map : messages.state.maps) {
    MapState alone = messages.state;
    alone.group = map;
    alone.maps = {map};
    alone.revision += 1 + map.agent_id;
    alone.num_constraints = 0;
    std::erase_if(alone.keyframes, [&](const KeyframePose& pose) { return pose.id.map != map; });
    server.ba.Take(alone);
  }
  EXPECT_FALSE(server.ba.HasWork());
}

}  // namespace
}  // namespace pangea

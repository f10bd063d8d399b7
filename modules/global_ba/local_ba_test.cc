// Adjustments of a part of a group, as GlobalBa makes them.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <set>

#include "global_ba/ba_test_world.h"
#include "global_ba/global_ba.h"
#include "options/yaml_options.h"

namespace pangea {
namespace {

using Choice = std::function<bool(const KeyframeId&)>;

// Three agents along a corridor whose end has no view of its start.
constexpr int kKeyframes = 40, kNew = 12;
BaTestWorld Corridor(double step_s = 0.5, int keyframes = kKeyframes) {
  return MakeBaTestWorld({.agents = 3,
                          .keyframes = keyframes,
                          .step_s = step_s,
                          .landmarks = 400,
                          .drift_m_s = 1,
                          .max_depth_m = 7,
                          .scale_error = 0,
                          .start_sigma_m = 0.01});
}

bool OfFirstTwo(const KeyframeId& id) { return id.map.agent_id < 3; }
// The third agent comes and walks a part of the way.
bool Later(const KeyframeId& id) { return OfFirstTwo(id) || id.seq < kNew; }

BaTestMessages Chosen(const BaTestMessages& all, const Choice& is_in) {
  BaTestMessages chosen;
  chosen.state = all.state;
  std::erase_if(chosen.state.keyframes, [&](const KeyframePose& p) { return !is_in(p.id); });
  std::erase_if(chosen.state.maps, [&](const MapId& map) { return !is_in({map, 0}); });
  chosen.state.group = chosen.state.maps.front();
  for (const Keyframe& keyframe : all.keyframes) {
    if (is_in(keyframe.id)) {
      chosen.keyframes.push_back(keyframe);
    }
  }
  for (const PlaceMatch& match : all.matches) {
    if (is_in(match.query)) {
      chosen.matches.push_back(match);
    }
  }
  for (const Constraint& constraint : all.constraints) {
    if (is_in(constraint.to) && is_in(constraint.from)) {
      chosen.constraints.push_back(constraint);
    }
  }
  chosen.state.num_constraints = std::max(1, static_cast<int>(chosen.constraints.size()));
  return chosen;
}

// A server with a pose graph that publishes given poses.
class Server {
 public:
  explicit Server(const LocalOptions& local) : ba_(Options(local)) {}

  void Take(const BaTestMessages& messages) {
    for (const Keyframe& keyframe : messages.keyframes) {
      ba_.Take(keyframe);
    }
    for (const PlaceMatch& match : messages.matches) {
      ba_.Take(match);
    }
    for (const Constraint& constraint : messages.constraints) {
      ba_.Take(constraint);
    }
    state_ = messages.state;
    PublishState();
  }

  // Does all work that is due, and publishes the state again after each refinement.
  MapState Finish() {
    MapState refined;
    while (ba_.HasWork()) {
      if (const auto state = ba_.Advance()) {
        EXPECT_GT(state->revision, refined.revision) << "the pose graph takes it for a repeat";
        refined = *state;
        while (ba_.HasWork()) {  // before the pose graph answers
          EXPECT_FALSE(ba_.Advance()) << "a second refinement of the same state";
        }
        for (const KeyframePose& pose : state->keyframes) {
          told_[pose.id] = pose.T_map_body;
        }
        PublishState();
      }
    }
    return refined;
  }

  // The whole is adjusted first, then the later keyframes.
  MapState FinishBoth(const BaTestMessages& all) {
    Take(Chosen(all, OfFirstTwo));
    first_ = Finish();
    Take(Chosen(all, Later));
    return Finish();
  }

  const GlobalBa::Counters& counters() const { return ba_.counters(); }
  const MapState& first() const { return first_; }

 private:
  static GlobalBaOptions Options(const LocalOptions& local) {
    GlobalBaOptions options;
    options.local = local;
    options.ba.function_tolerance = 1e-6;
    options.ba.max_iterations = 40;
    return options;
  }

  void PublishState() {
    MapState state = state_;
    state.revision = ++revision_;
    for (KeyframePose& pose : state.keyframes) {
      const auto told = told_.find(pose.id);
      pose.T_map_body = told == told_.end() ? pose.T_map_body : told->second;
    }
    ba_.Take(state);
  }

  GlobalBa ba_;
  int64_t revision_ = 0;
  MapState state_;  // with the poses of the pose graph alone
  MapPoses told_;
  MapState first_;
};

constexpr LocalOptions kLocal{.keyframes = 0, .max_neighbours = 30};
constexpr LocalOptions kWhole{.keyframes = 1'000'000};

BaTestMessages Messages() { return MessagesOf(Corridor()); }

// Largest error of a keyframe of the third agent, seen from the first.
double ErrorOfNew(const MapState& refined, const BaWorld& truth) {
  MapPoses found = PosesOf(refined);
  double largest = 0;
  for (const BaKeyframe& keyframe : truth.keyframes) {
    if (keyframe.id.map.agent_id == 3 && found.contains(keyframe.id)) {
      const BaKeyframe& first = truth.keyframes.front();
      const Eigen::Vector3d p = found.at(first.id).Inverse() * found.at(keyframe.id).t;
      const Eigen::Vector3d p_true = first.state.T_map_body.Inverse() * keyframe.state.T_map_body.t;
      largest = std::max(largest, (p - p_true).norm());
    }
  }
  return largest;
}

double LargestDifference(const MapState& a, const MapState& b) {
  const MapPoses poses_a = PosesOf(a), poses_b = PosesOf(b);
  const Rigid3 T_a_b = poses_a.begin()->second * poses_b.begin()->second.Inverse();
  double largest = 0;
  for (const auto& [id, pose] : poses_a) {
    largest = std::max(largest, (pose.t - T_a_b * poses_b.at(id).t).norm());
  }
  return largest;
}

TEST(LocalBa, APartIsAsGoodAsTheWhole) {
  const BaTestWorld world = Corridor();
  const BaTestMessages messages = MessagesOf(world);
  Server local(kLocal), whole(kWhole);
  const MapState of_local = local.FinishBoth(messages), of_whole = whole.FinishBoth(messages);
  EXPECT_EQ(local.counters().finished, 2);
  EXPECT_EQ(local.counters().finished_local, 1);
  EXPECT_EQ(whole.counters().finished_local, 0);
  ASSERT_EQ(of_local.keyframes.size(), of_whole.keyframes.size());
  EXPECT_LT(LargestDifference(of_local, of_whole), 0.005);
  EXPECT_LT(ErrorOfNew(of_local, world.truth), 1.2 * ErrorOfNew(of_whole, world.truth));
}

// Keyframes far from the new ones are bitwise unchanged; there is no jump in between.
TEST(LocalBa, TheRestStaysAndTheRimDoesNotJump) {
  Server server(kLocal);
  const MapState after = server.FinishBoth(Messages());
  const MapPoses before = PosesOf(server.first());
  int stayed = 0;
  const KeyframePose* previous = nullptr;
  for (const KeyframePose& pose : after.keyframes) {
    if (!OfFirstTwo(pose.id)) {
      continue;
    }
    stayed += pose.T_map_body.t == before.at(pose.id).t ? 1 : 0;
    if (previous != nullptr && previous->id.map == pose.id.map) {
      const Eigen::Vector3d step = pose.T_map_body.t - previous->T_map_body.t;
      const Eigen::Vector3d step_before = before.at(pose.id).t - before.at(previous->id).t;
      EXPECT_LT((step - step_before).norm(), 0.003) << ToString(pose.id);
    }
    previous = &pose;
  }
  EXPECT_GE(stayed, kKeyframes / 2);
  EXPECT_LT(stayed, 2 * kKeyframes - kNew);
}

TEST(LocalBa, AtMostSoManyNeighboursMove) {
  LocalOptions options = kLocal;
  options.max_neighbours = 5;
  Server server(options);
  const MapState after = server.FinishBoth(Messages());
  const MapPoses before = PosesOf(server.first());
  const auto moved = std::ranges::count_if(after.keyframes, [&](const KeyframePose& pose) {
    return OfFirstTwo(pose.id) && pose.T_map_body.t != before.at(pose.id).t;
  });
  EXPECT_EQ(moved, 5);
}

TEST(LocalBa, TheSameMessagesGiveTheSameBytes) {
  Server a(kLocal), b(kLocal);
  const MapState of_a = a.FinishBoth(Messages()), of_b = b.FinishBoth(Messages());
  for (size_t i = 0; i < of_a.keyframes.size(); ++i) {
    EXPECT_EQ(of_a.keyframes[i].T_map_body.t, of_b.keyframes[i].T_map_body.t);
  }
}

// A redundant keyframe keeps its pose relative to the refined one before it, and stays left out.
TEST(LocalBa, WhatWasLeftOutStaysOut) {
  Server server(kLocal);
  BaTestMessages messages = MessagesOf(Corridor(0.2));
  std::erase_if(messages.constraints, [](const Constraint& c) { return c.to.seq % 5 != 0; });
  const MapState after = server.FinishBoth(messages);
  ASSERT_EQ(server.counters().finished_local, 1);
  const MapPoses before = PosesOf(server.first()), now = PosesOf(after);
  EXPECT_LT(before.size(), 2 * kKeyframes);
  for (const KeyframePose& pose : after.keyframes) {
    EXPECT_TRUE(!OfFirstTwo(pose.id) || before.contains(pose.id) || pose.id.seq < kNew);
  }
  for (const auto& [id, pose] : before) {
    EXPECT_TRUE(now.contains(id));
  }
}

TEST(LocalBa, ASmallGroupIsAdjustedAsAWhole) {
  LocalOptions options;
  ASSERT_GT(options.keyframes, 3 * kKeyframes);
  Server server(options);
  server.FinishBoth(Messages());
  EXPECT_EQ(server.counters().finished, 2);
  EXPECT_EQ(server.counters().finished_local, 0);
}

TEST(LocalBa, AGroupThatHasGrownIsAdjustedAsAWhole) {
  LocalOptions options = kLocal;
  options.whole_growth = 1.1;
  Server server(options);
  server.FinishBoth(Messages());
  EXPECT_EQ(server.counters().finished, 2);
  EXPECT_EQ(server.counters().finished_local, 0);
}

TEST(LocalBa, AVeryLargeGroupThatHasGrownIsAdjustedInPart) {
  LocalOptions options = kLocal;
  options.whole_growth = 1;
  Server server(options);
  server.FinishBoth(MessagesOf(Corridor(0.1, 130)));
  EXPECT_EQ(server.counters().finished, 2);
  EXPECT_EQ(server.counters().finished_local, 1);
}

// Two groups that were adjusted separately.
TEST(LocalBa, AFusionIsAdjustedAsAWhole) {
  const BaTestMessages messages = Messages();
  Server server(kLocal);
  server.Take(Chosen(messages, [](const KeyframeId& id) { return id.map.agent_id == 1; }));
  server.Finish();
  server.Take(Chosen(messages, [](const KeyframeId& id) { return id.map.agent_id == 3; }));
  server.Finish();
  ASSERT_EQ(server.counters().finished, 2);
  server.Take(Chosen(messages, [](const KeyframeId& id) { return id.map.agent_id != 2; }));
  EXPECT_EQ(server.Finish().keyframes.size(), 2 * kKeyframes);
  EXPECT_EQ(server.counters().finished, 3);
  EXPECT_EQ(server.counters().finished_local, 0);
}

// The whole smaller group moves.
TEST(LocalBa, ASmallGroupThatJoinsALargeOneIsAPart) {
  const BaTestMessages messages = Messages();
  Server server(kLocal);
  server.Take(Chosen(messages, OfFirstTwo));
  server.Finish();
  server.Take(
      Chosen(messages, [](const KeyframeId& id) { return !OfFirstTwo(id) && id.seq < kNew; }));
  server.Finish();
  ASSERT_EQ(server.counters().finished, 2);
  server.Take(Chosen(messages, Later));
  EXPECT_EQ(server.Finish().keyframes.size(), 2 * kKeyframes + kNew);
  EXPECT_EQ(server.counters().finished_local, 1);
}

TEST(LocalBa, APartThatPullsAtTheRestIsFollowedByTheWhole) {
  LocalOptions options = kLocal;
  options.max_shift_m = 0;
  Server server(options);
  server.FinishBoth(Messages());
  EXPECT_EQ(server.counters().finished, 3);
  EXPECT_EQ(server.counters().finished_local, 1);
}

TEST(LocalBa, ALateResultMovesItsEnds) {
  const BaTestMessages messages = Messages();
  BaTestMessages late = Chosen(messages, OfFirstTwo);
  BaTestMessages first = late;
  first.constraints.pop_back();
  Server server(kLocal);
  server.Take(first);
  const MapPoses before = PosesOf(server.Finish());
  ++late.state.num_constraints;
  server.Take(late);
  const MapPoses after = PosesOf(server.Finish());
  EXPECT_EQ(server.counters().finished_local, 1);
  const Constraint& result = late.constraints.back();
  EXPECT_NE(before.at(result.to).t, after.at(result.to).t);
  EXPECT_NE(before.at(result.from).t, after.at(result.from).t);
  EXPECT_EQ(before.begin()->second.t, after.begin()->second.t);
}

// The matches of days.
TEST(LocalBa, ManyEarlierMatchesChangeNothing) {
  const BaTestMessages messages = Messages();
  BaTestMessages earlier = Chosen(messages, OfFirstTwo);
  Server few(kLocal), many(kLocal);
  for (Server* server : {&few, &many}) {
    server->Take(earlier);
    server->Finish();
  }
  PlaceMatch match;
  match.candidates.resize(1);
  for (int i = 0; i < 300'000; ++i) {
    match.query = {{9, 9}, i};
    match.candidates[0].match = {{9, 10}, i};
    earlier.matches.push_back(match);
  }
  many.Take(earlier);
  few.Take(Chosen(messages, Later));
  many.Take(Chosen(messages, Later));
  EXPECT_LT(LargestDifference(few.Finish(), many.Finish()), 1e-9);
}

// An agent that stands still sees the same landmarks for hours.
TEST(LocalBa, APartIsBoundedWhereAllSeeTheSame) {
  constexpr int kAll = 2000, kNeighbours = 20;
  const MapId map{1, 100};
  MapPoses state;
  AdjustedGroup adjusted;
  KeyframeStore store;
  for (int seq = 0; seq < kAll; ++seq) {
    Keyframe keyframe;
    keyframe.id = {map, seq};
    keyframe.corners.resize(5);
    for (int i = 0; i < 5; ++i) {
      keyframe.corners[i].landmark_id = i;
    }
    store.Add(keyframe);
    state[keyframe.id] = {};
    if (seq + 1 < kAll) {
      adjusted.keyframes[keyframe.id] = KeyframeState{};
    }
  }
  const LocalPart part = ChooseLocalPart(state, adjusted, {}, {}, kNeighbours, &store);
  EXPECT_EQ(part.moving.size(), 1u + kNeighbours);
  EXPECT_TRUE(part.moving.contains({map, kAll - 1}));
  EXPECT_TRUE(part.fixed.contains({map, kAll - 50}));
  EXPECT_LT(part.fixed.size(), 500u);
}

TEST(LocalBa, OptionsOutOfBoundsAreRefusedByName) {
  for (const std::string text :
       {"keyframes: -1", "max_neighbours: 2000000", "whole_growth: 0.9", "max_shift_m: -0.1"}) {
    GlobalBaOptions options;
    YamlOptions yaml;
    options.Visit(yaml);
    try {
      yaml.ReadText("local: {" + text + "}", "test.yaml");
      ADD_FAILURE() << text;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(text.substr(0, text.find(':'))), std::string::npos)
          << error.what();
    }
  }
}

}  // namespace
}  // namespace pangea

#include "place_recognition/place_recognition.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "core/testing/test_record_store.h"
#include "place_recognition/test_world.h"

namespace pangea {
namespace {

using test::kMapA;
using test::kMapB;
constexpr double kStepYaw = 0.1;
const Rigid3 kOdomB(YawRotation(1.1), Eigen::Vector3d(3, -2, 0.5));

// A body rotating on a small circle: one round is 63 keyframes.
Keyframe OnTheRound(test::TestWorld& world, const MapId& map, int seq, const Rigid3& T_odom_world,
                    int offset = 0) {
  const double yaw = kStepYaw * (seq + offset);
  return world.See({map, seq}, {2 * std::cos(yaw), 2 * std::sin(yaw), 1.5}, yaw, T_odom_world);
}

double YawApart(int a, int b) { return std::abs(WrapAngle(kStepYaw * (a - b))); }

MapState StateOf(int64_t revision, const std::vector<MapId>& maps) {
  MapState state;
  state.group = maps.front();
  state.revision = revision;
  state.maps = maps;
  return state;
}

bool SameMatch(const PlaceMatch& a, const PlaceMatch& b) {
  if (a.query != b.query || a.rejected != b.rejected ||
      a.candidates.size() != b.candidates.size()) {
    return false;
  }
  for (size_t i = 0; i < a.candidates.size(); ++i) {
    const PlaceCandidate& x = a.candidates[i];
    const PlaceCandidate& y = b.candidates[i];
    if (x.match != y.match || x.kind != y.kind || x.score != y.score ||
        x.corner_matches != y.corner_matches) {
      return false;
    }
  }
  return true;
}

TEST(PlaceRecognition, FindsTheSecondRoundOfItsOwnMapAndNothingInTheFirst) {
  test::TestWorld world(1);
  PlaceRecognition recognition({});
  int found = 0;
  for (int seq = 0; seq < 120; ++seq) {
    const PlaceMatch match = recognition.Add(OnTheRound(world, kMapA, seq, {}));
    EXPECT_EQ(match.query, (KeyframeId{kMapA, seq}));
    for (const PlaceCandidate& candidate : match.candidates) {
      EXPECT_EQ(candidate.kind, PlaceKind::kIntra);
      EXPECT_GE(seq - candidate.match.seq, 20);
      EXPECT_LT(YawApart(seq, candidate.match.seq), 1.4);  // the field of view
      EXPECT_GE(candidate.corner_matches.size(), 10u);
    }
    if (seq < 50) {
      EXPECT_TRUE(match.candidates.empty()) << seq;
    } else if (seq >= 70) {
      found += !match.candidates.empty();
    }
  }
  EXPECT_EQ(found, 50);
}

// The world gives both kinds the same bits; real ones would not be alike.
TEST(PlaceRecognition, ComparesNoDescriptorsOfDifferentKinds) {
  test::TestWorld world(2);
  PlaceRecognition recognition({});
  for (int seq = 0; seq < 20; ++seq) {
    recognition.Add(OnTheRound(world, kMapA, seq, {}));
  }
  Keyframe other = OnTheRound(world, kMapB, 0, kOdomB, 10);
  other.descriptor_kind = DescriptorKind::kPatchNetwork;
  std::vector<PlaceReport> checked;
  EXPECT_TRUE(recognition.Add(other, &checked).candidates.empty());
  EXPECT_TRUE(checked.empty());
  other.id.map.agent_id = 7;
  EXPECT_FALSE(recognition.Add(other).candidates.empty());
}

TEST(PlaceRecognition, FindsTheOtherMapWhateverItsOdomFrame) {
  test::TestWorld world(2);
  PlaceRecognition recognition({});
  for (int seq = 0; seq < 63; ++seq) {
    recognition.Add(OnTheRound(world, kMapA, seq, {}));
  }
  for (int seq = 0; seq < 20; ++seq) {
    const PlaceMatch match = recognition.Add(OnTheRound(world, kMapB, seq, kOdomB, 17));
    ASSERT_FALSE(match.candidates.empty()) << seq;
    for (const PlaceCandidate& candidate : match.candidates) {
      EXPECT_EQ(candidate.match.map, kMapA);
      EXPECT_EQ(candidate.kind, PlaceKind::kInter);
      EXPECT_LT(YawApart(seq + 17, candidate.match.seq), 1.4);
    }
  }
}

TEST(PlaceRecognition, CornerMatchesJoinTheSamePoint) {
  test::TestWorld world(3);
  PlaceRecognition recognition({});
  const Keyframe a = world.See({kMapA, 0}, {0, 0, 1.5}, 0, {}, true);
  const Keyframe b = world.See({kMapB, 0}, {0.5, 0.6, 1.4}, 0.2, kOdomB, true);
  recognition.Add(a);
  const PlaceMatch match = recognition.Add(b);
  ASSERT_EQ(match.candidates.size(), 1u);
  int right = 0;
  int wrong = 0;
  for (const auto& [query_corner, match_corner] : match.candidates[0].corner_matches) {
    (b.corners[query_corner].landmark_id == a.corners[match_corner].landmark_id ? right : wrong)++;
  }
  EXPECT_GE(right, 60);
  EXPECT_LE(wrong, right / 20);
}

TEST(PlaceRecognition, AnotherWorldIsNotMatched) {
  test::TestWorld world(4);
  test::TestWorld other(5);
  PlaceRecognition recognition({});
  for (int seq = 0; seq < 63; ++seq) {
    recognition.Add(OnTheRound(world, kMapA, seq, {}));
  }
  for (int seq = 0; seq < 40; ++seq) {
    EXPECT_TRUE(recognition.Add(OnTheRound(other, kMapB, seq, kOdomB)).candidates.empty());
  }
}

TEST(PlaceRecognition, WhatOdometryStillTracksIsNoLoop) {
  test::TestWorld world(6);
  PlaceRecognition recognition({});
  for (int seq = 0; seq < 60; ++seq) {  // hovering
    EXPECT_TRUE(recognition.Add(world.See({kMapA, seq}, {0.01 * seq, 0, 1.5}, 0, {}, true))
                    .candidates.empty());
  }
}

TEST(PlaceRecognition, OneMapDoesNotCrowdOutAnother) {
  test::TestWorld world(7);
  PlaceRecognition recognition({});
  for (int seq = 0; seq < 100; ++seq) {  // a round and a half
    recognition.Add(OnTheRound(world, kMapA, seq, {}));
  }
  const MapId map_c{3, 3000};
  recognition.Add(world.See({map_c, 0}, {0.5, 1.5, 1.5}, 0.45));  // seen less well
  const PlaceMatch match = recognition.Add(OnTheRound(world, kMapB, 0, kOdomB));
  EXPECT_TRUE(std::any_of(match.candidates.begin(), match.candidates.end(),
                          [&](const PlaceCandidate& c) { return c.match.map == map_c; }));
}

TEST(PlaceRecognition, AFusedMapsOwnLoopsAreInterUntilItIsTakenOut) {
  const auto kind_after = [](auto set_groups) {
    test::TestWorld world(8);
    PlaceRecognition recognition({});
    recognition.Add(world.See({kMapA, 0}, {0, 0, 1.5}, 0));
    set_groups(recognition);
    return recognition.Add(world.See({kMapA, 40}, {0.2, 0, 1.5}, 0)).candidates.at(0).kind;
  };
  EXPECT_EQ(kind_after([](PlaceRecognition&) {}), PlaceKind::kIntra);
  EXPECT_EQ(kind_after([](PlaceRecognition& r) { r.Take(StateOf(1, {kMapA})); }),
            PlaceKind::kIntra);
  EXPECT_EQ(kind_after([](PlaceRecognition& r) {
              r.Take(StateOf(1, {kMapA, kMapB}));
            }),
            PlaceKind::kInter);
  EXPECT_EQ(kind_after([](PlaceRecognition& r) {
              r.Take(StateOf(1, {kMapA, kMapB}));
              r.Take(StateOf(2, {kMapB}));
            }),
            PlaceKind::kIntra);
  EXPECT_EQ(kind_after([](PlaceRecognition& r) {  // an old message repeated
              r.Take(StateOf(2, {kMapA, kMapB}));
              r.Take(StateOf(1, {kMapA}));
            }),
            PlaceKind::kInter);
}

TEST(PlaceRecognition, TheSameKeyframesGiveTheSameMatches) {
  std::vector<PlaceMatch> runs[2];
  for (auto& run : runs) {
    test::TestWorld world(9);
    PlaceRecognition recognition({});
    for (int seq = 0; seq < 35; ++seq) {
      run.push_back(recognition.Add(OnTheRound(world, kMapA, seq, {})));
      run.push_back(recognition.Add(OnTheRound(world, kMapB, seq, kOdomB, 30)));
    }
  }
  for (size_t i = 0; i < runs[0].size(); ++i) {
    EXPECT_TRUE(SameMatch(runs[0][i], runs[1][i])) << i;
  }
}

TEST(PlaceRecognition, ARememberedKeyframeIsFoundLikeAnyOther) {
  test::TestWorld world(10);
  PlaceRecognition recognition({});
  recognition.Remember(world.See({kMapA, 0}, {0, 0, 1.5}, 0), {{kMapA, 0}, {}, {}});
  EXPECT_EQ(recognition.Add(world.See({kMapB, 0}, {0.2, 0, 1.5}, 0)).candidates.size(), 1u);
}

TEST(PlaceRecognition, AKeyframeWithoutCornersIsAnsweredToo) {
  PlaceRecognition recognition({});
  Keyframe keyframe;
  keyframe.id = {kMapA, 0};
  keyframe.camera = EurocTestCamera();
  EXPECT_TRUE(recognition.Add(keyframe).candidates.empty());
  keyframe.id = {kMapA, 30};
  EXPECT_TRUE(recognition.Add(keyframe).candidates.empty());
}

// Two maps of one place.
std::vector<PlaceMatch> MatchesOf(PlaceRecognition recognition) {
  test::TestWorld world(7);
  std::vector<PlaceMatch> matches;
  for (int seq = 0; seq < 40; ++seq) {
    matches.push_back(recognition.Add(OnTheRound(world, kMapA, seq, {})));
    matches.push_back(recognition.Add(OnTheRound(world, kMapB, seq, kOdomB, 17)));
  }
  return matches;
}

TEST(PlaceRecognition, SaysTheSameWhereverTheCornersLie) {
  const std::vector<PlaceMatch> in_memory = MatchesOf(PlaceRecognition({}));
  for (const size_t max_records : {30, 10000}) {
    const auto records = std::make_shared<test::TestRecordStore>(max_records);
    const std::vector<PlaceMatch> matches = MatchesOf(PlaceRecognition({}, records));
    EXPECT_EQ(records->size(), std::min<size_t>(80, max_records));
    int candidates = 0;
    for (size_t i = 0; i < matches.size(); ++i) {
      EXPECT_TRUE(SameMatch(matches[i], in_memory[i])) << i;
      candidates += static_cast<int>(matches[i].candidates.size());
    }
    EXPECT_GT(candidates, 0);
  }
}

TEST(PlaceRecognition, APlaceThatCannotBeReadIsRefused) {
  test::TestWorld world(8);
  const auto records = std::make_shared<test::TestRecordStore>(1000);
  PlaceRecognition recognition({}, records);
  recognition.Add(OnTheRound(world, kMapA, 0, {}));
  records->broken = true;
  const PlaceMatch match = recognition.Add(OnTheRound(world, kMapB, 0, kOdomB));
  EXPECT_TRUE(match.candidates.empty());
  ASSERT_EQ(match.rejected.size(), 1u);
  EXPECT_NE(match.rejected[0].find("cannot be read"), std::string::npos);
  EXPECT_EQ(recognition.store_counters().unreadable, 1);
}

}  // namespace
}  // namespace pangea

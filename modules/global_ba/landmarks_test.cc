#include "global_ba/landmarks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "core/testing/test_cameras.h"
#include "global_ba/ba_test_world.h"
#include "global_ba/group_world.h"

namespace pangea {
namespace {

constexpr int kKeyframesPerAgent = 6;

// Two agents with exact rays and poses.
struct Group {
  Group()
      : truth(MakeBaTestWorld({.keyframes = kKeyframesPerAgent,
                               .step_s = 0.51,  // so far apart that none is redundant
                               .landmarks = 40,
                               .noise = 0,
                               .scale_error = 0,
                               .start_sigma_m = 0})),
        messages(MessagesOf(truth)) {
    for (const PlaceMatch& match : messages.matches) {
      for (const PlaceCandidate& candidate : match.candidates) {
        pairs.push_back({match.query, candidate.match, candidate.corner_matches});
      }
    }
  }
  BaWorld World(int max_views = 256) const {
    KeyframeStore store({.max_views = max_views, .keep_preintegration = true});
    for (const Keyframe& keyframe : messages.keyframes) {
      store.Add(keyframe);
    }
    return MakeGroupWorld(PosesOf(messages.state), pairs, &store);
  }

  BaTestWorld truth;
  BaTestMessages messages;
  std::vector<MatchedPair> pairs;
};

// Number of landmarks that keyframes of both agents see.
int CountShared(const BaWorld& world) {
  std::map<int, std::array<bool, 2>> seen_by;
  for (const BaObservation& seen : world.observations) {
    seen_by[seen.landmark][seen.keyframe / kKeyframesPerAgent] = true;
  }
  int shared = 0;
  for (const auto& [landmark, agents] : seen_by) {
    shared += agents[0] && agents[1] ? 1 : 0;
  }
  return shared;
}

TEST(Landmarks, AreWhereTheirRaysMeet) {
  const BaWorld world = Group().World();
  ASSERT_GE(world.landmarks.size(), 60u);  // two tracks for each of 40 points
  const BaWorld truth = Group().truth.truth;
  for (const Eigen::Vector3d& landmark : world.landmarks) {
    double nearest = 1e3;
    for (const Eigen::Vector3d& point : truth.landmarks) {
      nearest = std::min(nearest, (landmark - point).norm());
    }
    EXPECT_LT(nearest, 1e-4);
  }
}

TEST(Landmarks, AreTheSameHoweverFewKeyframesAreHeld) {
  const Group group;
  const BaWorld all = group.World(), few = group.World(1);
  EXPECT_EQ(all.landmarks, few.landmarks);
  ASSERT_EQ(all.observations.size(), few.observations.size());
  for (size_t i = 0; i < all.observations.size(); ++i) {
    EXPECT_EQ(all.observations[i].keyframe, few.observations[i].keyframe);
    EXPECT_EQ(all.observations[i].landmark, few.observations[i].landmark);
    EXPECT_EQ(all.observations[i].ray, few.observations[i].ray);
  }
}

TEST(Landmarks, MatchesTieTwoMapsOnceForEachPairOfTracks) {
  Group group;
  const BaWorld all = group.World();
  EXPECT_GT(CountShared(all), 0.9 * static_cast<double>(all.landmarks.size()));
  group.pairs.resize(1);
  const BaWorld one = group.World();
  EXPECT_GT(CountShared(one), 0);
  const size_t with_one = one.observations.size();
  group.pairs.push_back(group.pairs.front());
  EXPECT_EQ(group.World().observations.size(), with_one);
  group.pairs.clear();
  EXPECT_EQ(CountShared(group.World()), 0);
}

TEST(Landmarks, AMatchCountsAsItsCornersAreFound) {
  Group group;
  for (Keyframe& keyframe : group.messages.keyframes) {
    for (Corner& corner : keyframe.corners) {
      corner.octave = 2;
      // Agent 2 has no tracks: each match is one observation, with the full weight of a corner.
      corner.landmark_id = keyframe.id.map.agent_id == 1 ? corner.landmark_id : kNoLandmark;
    }
  }
  const BaWorld world = group.World();
  int matched = 0;
  double track = 0;
  for (const BaObservation& seen : world.observations) {
    const bool own = seen.keyframe < kKeyframesPerAgent;
    track = own ? std::max(track, seen.sqrt_info.norm()) : track;
    matched += own ? 0 : 1;
  }
  ASSERT_GT(matched, 0);
  const double ratio = kTrackSigma_px / (kMatchSigma_px * 1.44);
  for (const BaObservation& seen : world.observations) {
    if (seen.keyframe >= kKeyframesPerAgent) {
      EXPECT_NEAR(seen.sqrt_info.norm() / (track * ratio), 1,
                  0.35);  // the lens varies over the image
    }
  }
}

// If both corners are tracked, each landmark is observed at the other's corner: one measurement, so
// half the weight each.
TEST(Landmarks, AMatchOfTwoTracksCountsOnce) {
  const BaWorld world = Group().World();
  std::map<int, int> owner;  // agent of each landmark: its own track comes first
  std::map<std::pair<int, double>, double> own;
  int matched = 0;
  for (const BaObservation& seen : world.observations) {
    if (owner.try_emplace(seen.landmark, seen.keyframe / kKeyframesPerAgent).first->second ==
        seen.keyframe / kKeyframesPerAgent) {
      own[{seen.keyframe, seen.ray.x()}] = seen.sqrt_info.norm();
    }
  }
  const double ratio = std::sqrt(0.5) * kTrackSigma_px / kMatchSigma_px;
  for (const BaObservation& seen : world.observations) {
    const auto same_corner = own.find({seen.keyframe, seen.ray.x()});
    if (owner.at(seen.landmark) != seen.keyframe / kKeyframesPerAgent && same_corner != own.end()) {
      EXPECT_NEAR(seen.sqrt_info.norm() / same_corner->second, ratio, 1e-6);
      ++matched;
    }
  }
  EXPECT_GT(matched, 10);
}

// Neighbouring keyframes of one track, matched with the same corner of a keyframe without tracks.
TEST(Landmarks, ACornerSeesATrackOnceHoweverManyKeyframesItIsMatchedWith) {
  Group group;
  std::vector<Keyframe>& keyframes = group.messages.keyframes;
  std::vector<MatchedPair> beside;
  size_t offered_again = 0;
  for (const MatchedPair& pair : group.pairs) {
    const int neighbour = pair.match.seq > 0 ? pair.match.seq - 1 : 1;
    MatchedPair& other = beside.emplace_back(pair);
    other.match = keyframes[neighbour].id;
    other.corners.clear();
    for (const auto& [corner, unused] : pair.corners) {
      const int32_t id = keyframes[kKeyframesPerAgent + pair.query.seq].corners[corner].landmark_id;
      const auto& there = keyframes[neighbour].corners;
      const auto same = std::ranges::find(there, id, &Corner::landmark_id);
      if (same != there.end()) {
        other.corners.emplace_back(corner, static_cast<int>(same - there.begin()));
      }
    }
    offered_again += other.corners.size();
  }
  ASSERT_GT(offered_again, 10u);
  for (Keyframe& keyframe : keyframes) {
    for (Corner& corner : keyframe.corners) {
      corner.landmark_id = keyframe.id.map.agent_id == 1 ? corner.landmark_id : kNoLandmark;
    }
  }
  group.pairs.insert(group.pairs.end(), beside.begin(), beside.end());
  const BaWorld world = group.World();
  std::set<std::tuple<int, int, double, double>> seen_once;
  for (const BaObservation& seen : world.observations) {
    EXPECT_TRUE(
        seen_once.insert({seen.landmark, seen.keyframe, seen.ray.x(), seen.ray.y()}).second);
  }
}

TEST(Landmarks, ATrackThatIsNotOnePointIsLeftOut) {
  Group group;
  const size_t all = group.World().landmarks.size();
  group.messages.keyframes[2].corners.front().pixel += Eigen::Vector2f(60, 40);
  EXPECT_EQ(group.World().landmarks.size(), all - 1);
}

TEST(Landmarks, AWrongMatchIsLeftOut) {
  Group group;
  const size_t right = group.World().observations.size();
  for (MatchedPair& pair : group.pairs) {
    for (size_t i = 0; i + 1 < pair.corners.size(); i += 2) {
      std::swap(pair.corners[i].second, pair.corners[i + 1].second);
    }
  }
  const BaWorld world = group.World();
  EXPECT_LT(world.observations.size(), right);
  for (const BaObservation& seen : world.observations) {
    const BaKeyframe& keyframe = world.keyframes[seen.keyframe];
    const Eigen::Vector3d p_cam =
        (keyframe.state.T_map_body * world.cameras[keyframe.camera].T_body_cam).Inverse() *
        world.landmarks[seen.landmark];
    EXPECT_LT((seen.sqrt_info * (p_cam.hnormalized() - seen.ray)).norm(), kMaxStartSigmas);
  }
}

TEST(Landmarks, ParallelRaysMakeNone) {
  Group group;
  group.pairs.clear();
  group.messages.state.keyframes.resize(1);
  EXPECT_TRUE(group.World().landmarks.empty());
}

TEST(GroupWorld, IsTheGraphsPosesWithTheOdometrysMotion) {
  Group group;
  const Rigid3 rotated(YawRotation(0.5), {1, 2, 3});
  for (KeyframePose& pose : group.messages.state.keyframes) {
    pose.T_map_body = rotated * pose.T_map_body;
  }
  const BaWorld world = group.World();
  ASSERT_EQ(world.keyframes.size(), 2u * kKeyframesPerAgent);
  for (size_t i = 0; i < world.keyframes.size(); ++i) {
    const KeyframeState& got = world.keyframes[i].state;
    const KeyframeState& odometry = group.truth.start.keyframes[i].state;
    EXPECT_LT((got.v_map_body - rotated.q * odometry.v_map_body).norm(), 1e-9);
    EXPECT_EQ(world.keyframes[i].preintegration.has_value(), i % kKeyframesPerAgent != 0);
  }
}

// An odometry refines its extrinsics while it runs: each map uses those of its last keyframe.
TEST(GroupWorld, EachMapHasItsLastCamera) {
  Group group;
  for (Keyframe& keyframe : group.messages.keyframes) {
    keyframe.camera.T_body_cam.t.x() = 0.1 * keyframe.id.map.agent_id + 1e-6 * keyframe.id.seq;
  }
  const BaWorld world = group.World();
  ASSERT_EQ(world.cameras.size(), 2u);
  for (int agent = 0; agent < 2; ++agent) {
    EXPECT_DOUBLE_EQ(world.cameras[agent].T_body_cam.t.x(),
                     0.1 * (agent + 1) + 1e-6 * (kKeyframesPerAgent - 1));
    EXPECT_EQ(world.keyframes[agent * kKeyframesPerAgent].camera, agent);
  }
}

// A keyframe of an agent with its own odometry, or of a lift.
TEST(GroupWorld, AnEdgeWithoutPreintegrationContinuesTheChain) {
  Group group;
  group.messages.keyframes[2].preintegration.reset();
  const BaKeyframe keyframe = group.World().keyframes[2];
  EXPECT_EQ(keyframe.previous, 1);
  EXPECT_TRUE(keyframe.edge);
  EXPECT_FALSE(keyframe.preintegration);
}

// A missing keyframe: the chain of edges starts again after it.
TEST(GroupWorld, AMissingKeyframeBreaksTheChain) {
  Group group;
  group.messages.keyframes.erase(group.messages.keyframes.begin() + 2);
  const BaWorld world = group.World();
  ASSERT_EQ(world.keyframes.size(), 2u * kKeyframesPerAgent - 1);
  EXPECT_EQ(world.keyframes[2].previous, -1);
  EXPECT_EQ(world.keyframes[3].previous, 2);
}

// A keyframe has one corner per octave of a landmark, and an odometry may sort them by octave.
TEST(Landmarks, SeveralCornersOfALandmarkAreOneObservationInAnyOrder) {
  Group group;
  const BaWorld once = group.World();
  for (Keyframe& keyframe : group.messages.keyframes) {
    const std::vector<Corner> corners = keyframe.corners;
    for (Corner corner : corners) {
      ++corner.octave;
      keyframe.corners.push_back(corner);
    }
  }
  const BaWorld twice = group.World();
  EXPECT_EQ(twice.landmarks.size(), once.landmarks.size());
  EXPECT_EQ(twice.observations.size(), once.observations.size());
}

// An agent comes, and then stands still for hours before the same landmarks.
TEST(Landmarks, ATrackThatDoesNotEndIsCut) {
  constexpr int kMoving = 20, kStanding = 400, kPoints = 30;
  const MapId map{1, 100};
  KeyframeStore store;
  MapPoses poses;
  for (int seq = 0; seq < kMoving + kStanding; ++seq) {
    Keyframe keyframe;
    keyframe.id = {map, seq};
    keyframe.utime = int64_t{5'000'000} * seq;
    keyframe.camera = EurocTestCamera();
    keyframe.T_odom_body.t.y() = -0.1 * std::max(0, kMoving - seq);
    if (seq > 0) {
      keyframe.edge = OdometryEdge{seq - 1, {}, 1e-4 * Matrix6d::Identity()};
      keyframe.edge->T_from_this.t.y() = seq <= kMoving ? 0.1 : 0;
    }
    const Rigid3 T_cam_map = keyframe.T_odom_cam().Inverse();
    for (int i = 0; i < kPoints; ++i) {
      const Eigen::Vector3d p_cam =
          T_cam_map * (EurocTestCamera().T_body_cam *
                       Eigen::Vector3d(0.1 * (i % 6) - 0.3, 0.1 * (i / 6) - 0.2, 3));
      const auto pixel = keyframe.camera.Project(p_cam);
      if (pixel && keyframe.camera.Contains(*pixel)) {
        Corner& corner = keyframe.corners.emplace_back();
        corner.pixel = pixel->cast<float>();
        corner.landmark_id = i;
      }
    }
    poses[keyframe.id] = keyframe.T_odom_body;
    store.Add(std::move(keyframe));
  }
  const BaWorld world = MakeGroupWorld(poses, {}, &store);
  std::map<int, int> times_seen;
  for (const BaObservation& seen : world.observations) {
    ++times_seen[seen.landmark];
  }
  EXPECT_GE(world.landmarks.size(), size_t{kPoints} / 2);
  for (const auto& [landmark, times] : times_seen) {
    EXPECT_LE(times, 100);
  }
}

}  // namespace
}  // namespace pangea

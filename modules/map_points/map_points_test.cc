#include "map_points/map_points.h"

#include <gtest/gtest.h>

#include <random>

#include "bus/bus.h"
#include "core/testing/test_cameras.h"
#include "core/testing/test_descriptors.h"
#include "map_points/map_points_process.h"
#include "messages/channels.h"
#include "messages/messages.h"
#include "pangea/have_t.hpp"
#include "pangea/resend_request_t.hpp"

namespace pangea {
namespace {

using Eigen::Vector3d;

const MapId kOld{1, 100};
const MapId kAgent{2, 200};

// A wall of points along y at x = 6, and cameras that pass in front of it. The map of agent 1
// covers the whole wall; agent 2 is in the same group.
class MapPointsTest : public ::testing::Test {
 protected:
  MapPointsTest() : camera_(PinholeTestCamera(752, 480, 458)) {
    camera_.T_body_cam.q = LookingAhead();
    std::mt19937_64 rng(4);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 600; ++i) {
      points_.emplace_back(6 + 0.5 * uniform(rng), 10 * uniform(rng), 2 * uniform(rng));
      descriptors_.push_back(RandomDescriptor(rng));
    }
    state_.group = kOld;
    state_.revision = 5;
    state_.maps = {kOld, kAgent};
    for (int i = 0; i < 40; ++i) {
      Add({kOld, i}, {0, -8 + 0.4 * i, 0});
    }
    for (int i = 0; i < 3; ++i) {
      Add({kAgent, i}, {0.3, -0.4 + 0.2 * i, 0});
    }
  }

  void Add(const KeyframeId& id, const Vector3d& p_map) {
    Keyframe keyframe;
    keyframe.id = id;
    keyframe.utime = 1'000'000 * id.seq;
    keyframe.camera = camera_;
    keyframe.T_odom_body.t = p_map;
    const Rigid3 T_cam_map = keyframe.T_odom_cam().Inverse();
    for (size_t i = 0; i < points_.size(); ++i) {
      const Vector3d p_cam = T_cam_map * points_[i];
      const auto pixel = camera_.Project(p_cam);
      if (pixel && camera_.Contains(*pixel, 5) && keyframe.corners.size() < 150) {
        Corner corner;
        corner.pixel = pixel->cast<float>();
        corner.descriptor = descriptors_[i];
        corner.landmark_id = static_cast<int32_t>(i);
        const auto depth = static_cast<float>(1 / p_cam.z());
        keyframe.points.push_back(
            {static_cast<int>(keyframe.corners.size()), depth, 1e-4f * depth * depth});
        keyframe.corners.push_back(corner);
      }
    }
    keyframes_.push_back(keyframe);
    state_.keyframes.push_back({id, keyframe.utime, keyframe.T_odom_body});
  }

  MapPoints Filled() const {
    MapPoints points;
    for (const Keyframe& keyframe : keyframes_) {
      points.Take(keyframe);
    }
    points.Take(state_);
    return points;
  }
  static AgentPose PoseAt(double y) {
    return {kAgent, {Eigen::Quaterniond::Identity(), {0.3, y, 0}}};
  }

  CameraModel camera_;
  std::vector<Vector3d> points_;
  std::vector<Descriptor> descriptors_;
  std::vector<Keyframe> keyframes_;
  MapState state_;
};

TEST_F(MapPointsTest, TellsWhatTheAgentWillSee) {
  MapPoints points = Filled();
  points.TakeRefined(state_);
  const auto message = points.Choose(PoseAt(0));
  ASSERT_TRUE(message);
  EXPECT_EQ(message->map, kAgent);
  EXPECT_EQ(message->group, kOld);
  EXPECT_EQ(message->revision, 5);
  EXPECT_GT(message->landmarks.size(), 10u);
  EXPECT_LE(message->landmarks.size(), static_cast<size_t>(kMaxMessageLandmarks));
  EXPECT_LE(message->sources.size(), static_cast<size_t>(kMaxMessageSources));
  const Rigid3 T_cam_map = (PoseAt(0).T_map_body * camera_.T_body_cam).Inverse();
  for (const MapLandmark& landmark : message->landmarks) {
    const auto pixel = camera_.Project(T_cam_map * landmark.p_map);
    EXPECT_TRUE(pixel && camera_.Contains(*pixel));
    EXPECT_LT((landmark.p_map - points_[landmark.landmark_id]).norm(), 0.01);
    EXPECT_EQ(landmark.descriptor, descriptors_[landmark.landmark_id]);
    EXPECT_GE(landmark.sigma_along_m, landmark.sigma_across_m);
    // Its own keyframes are too recent
    EXPECT_EQ(message->sources[landmark.source].keyframe.map, kOld);
  }
  EXPECT_LE(ToMessage(*message).getEncodedSize(), 1200);
}

TEST_F(MapPointsTest, SendsNoDescriptorsOfAKindThatTheAgentDoesNotCompute) {
  for (Keyframe& keyframe : keyframes_) {
    if (keyframe.id.map == kAgent) {
      keyframe.descriptor_kind = DescriptorKind::kPatchNetwork;
    }
  }
  MapPoints points = Filled();
  points.TakeRefined(state_);
  EXPECT_FALSE(points.Choose(PoseAt(0)));
}

class CountingStore : public RecordStore {
 public:
  std::optional<int64_t> Append(std::span<const uint8_t> record) override {
    records_.emplace_back(record.begin(), record.end());
    return static_cast<int64_t>(records_.size()) - 1;
  }
  bool Read(int64_t offset, std::span<uint8_t> record) override {
    ++num_reads;
    std::ranges::copy(records_[offset], record.begin());
    return true;
  }
  std::string problem() const override { return ""; }

  int num_reads = 0;

 private:
  std::vector<std::vector<uint8_t>> records_;
};

// Hours in one room: a message must not take longer than the time until the next one.
TEST_F(MapPointsTest, OnlyTheNearestOfVeryManyAreRead) {
  for (int i = 40; i < 2000; ++i) {
    Add({kOld, i}, {-0.001 * i, -8 + 0.4 * (i % 40), 0});
  }
  const auto records = std::make_shared<CountingStore>();
  MapPoints points(records);
  for (const Keyframe& keyframe : keyframes_) {
    points.Take(keyframe);
  }
  points.Take(state_);
  points.TakeRefined(state_);
  const auto message = points.Choose(PoseAt(0));
  ASSERT_TRUE(message);
  EXPECT_GT(message->landmarks.size(), 10u);
  EXPECT_LT(records->num_reads, 600);
}

TEST_F(MapPointsTest, DoesNotRepeatItselfAtOnce) {
  MapPoints points = Filled();
  points.TakeRefined(state_);
  std::set<int32_t> sent_points;
  for (int i = 0; i < 5; ++i) {
    const auto message = points.Choose(PoseAt(0));
    ASSERT_TRUE(message) << i;
    for (const MapLandmark& landmark : message->landmarks) {
      EXPECT_TRUE(sent_points.insert(landmark.landmark_id).second);
    }
  }
  // Landmarks that have moved are sent again.
  for (KeyframePose& pose : state_.keyframes) {
    pose.T_map_body.t.z() += 0.02;
  }
  ++state_.revision;
  points.Take(state_);
  AgentPose moved = PoseAt(0);
  moved.T_map_body.t.z() += 0.02;
  const auto message = points.Choose(moved);
  ASSERT_TRUE(message);
  EXPECT_TRUE(sent_points.contains(message->landmarks.front().landmark_id));
}

TEST_F(MapPointsTest, OnlyAdjustedKeyframesOfTheGroupAreSources) {
  MapPoints points = Filled();
  EXPECT_FALSE(points.Choose(PoseAt(0)));  // nothing was adjusted
  points.TakeRefined(state_);
  EXPECT_TRUE(points.Choose(PoseAt(0)));
  EXPECT_FALSE(points.Choose({{9, 9}, PoseAt(0).T_map_body}));  // a stranger
  EXPECT_FALSE(points.Choose(PoseAt(50)));                      // nothing is near
  AgentPose rotated = PoseAt(0);
  rotated.T_map_body.q = YawRotation(3.14);
  EXPECT_FALSE(points.Choose(rotated));
}

// Started again on a finished map, it asks for the state; global_ba answers with the refinement.
TEST_F(MapPointsTest, ProcessThatStartsLateAsksForTheStateOfAnOldMap) {
  LocalBus bus;
  MapPointsProcess process(bus);
  std::vector<resend_request_t> requests;
  bus.Subscribe(std::string(channels::kResendRequest), [&](const std::string&, Bytes data) {
    resend_request_t request{};
    ASSERT_TRUE(DecodeMessage(data, &request));
    if (request.channel == channels::kMapState) {
      requests.push_back(request);
    }
  });
  have_t have{};
  have.num_maps = 1;
  have.maps.push_back(ToMessage(kOld));
  have.highest_seq.push_back(39);
  PublishMessage(bus, std::string(channels::kHave), have);
  bus.Drain();
  process.Tick(1'000'000);
  bus.Drain();
  ASSERT_EQ(requests.size(), 1u);
  EXPECT_EQ(Parse(requests[0].map).value, kOld);
  for (const map_state_t& chunk : ToMessages(state_)) {
    PublishMessage(bus, std::string(channels::kMapState), chunk);
  }
  bus.Drain();
  process.Tick(9'000'000);
  bus.Drain();
  EXPECT_EQ(requests.size(), 1u);
}

// A refinement may come before the journal's keyframes are read.
TEST_F(MapPointsTest, ARefinementMayComeBeforeItsKeyframes) {
  MapPoints points;
  points.TakeRefined(state_);
  for (const Keyframe& keyframe : keyframes_) {
    points.Take(keyframe);
  }
  points.Take(state_);
  EXPECT_TRUE(points.Choose(PoseAt(0)));
}

TEST_F(MapPointsTest, ProcessAnswersPosesAtMostTwiceASecond) {
  LocalBus bus;
  MapPointsProcess process(bus);
  std::vector<landmarks_t> sent_points;
  bus.Subscribe(channels::Landmarks(kAgent.agent_id), [&](const std::string&, Bytes data) {
    ASSERT_TRUE(DecodeMessage(data, &sent_points.emplace_back()));
  });
  for (const Keyframe& keyframe : keyframes_) {
    PublishMessage(bus, channels::Keyframe(keyframe.id.map.agent_id), ToMessage(keyframe));
  }
  for (const map_state_t& chunk : ToMessages(state_)) {
    PublishMessage(bus, std::string(channels::kMapState), chunk);
    PublishMessage(bus, std::string(channels::kRefinement), chunk);
  }
  bus.Drain();
  pose_t pose{};
  pose.state = pose_t::STATE_TRACKING;
  pose.map = ToMessage(kAgent);
  pose.T_odom_body = ToMessage(PoseAt(0).T_map_body);
  pose.T_map_body = pose.T_odom_body;
  const auto send = [&](int64_t utime, int64_t revision) {
    pose.utime = utime;
    pose.group_revision = revision;
    PublishMessage(bus, channels::Pose(kAgent.agent_id), pose);
    bus.Drain();
  };
  send(1'000'000, 0);  // knows of no group yet
  EXPECT_TRUE(sent_points.empty());
  for (int i = 0; i < 20; ++i) {
    send(2'000'000 + 50'000 * i, 5);
  }
  EXPECT_EQ(sent_points.size(), 2u);
  EXPECT_TRUE(Parse(sent_points.front()).value);
  pose.T_map_body.translation.x = NAN;
  send(9'000'000, 5);
  pose.T_map_body.translation.x = 0;
  send(std::numeric_limits<int64_t>::min(), 5);
  EXPECT_EQ(sent_points.size(), 2u);
}

}  // namespace
}  // namespace pangea

#include "messages/messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "core/testing/test_descriptors.h"
#include "messages/catch_up_messages.h"
#include "messages/encoding.h"

namespace pangea {
namespace {

Keyframe RandomKeyframe(uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto vector = [&](double scale) -> Eigen::Vector3d {
    return Eigen::Vector3d(unit(rng) - 0.5, unit(rng) - 0.5, unit(rng) - 0.5) * 2 * scale;
  };
  Keyframe keyframe;
  keyframe.id = {{3, 1700000000000000}, 12};
  keyframe.utime = 1403636584763555;
  keyframe.camera.width = 752;
  keyframe.camera.height = 480;
  keyframe.camera.fx = keyframe.camera.fy = 458;
  keyframe.camera.cx = 367;
  keyframe.camera.cy = 248;
  keyframe.camera.T_body_cam = {ExpSo3(vector(1)), vector(0.1)};
  keyframe.T_odom_body = {ExpSo3(vector(1)), vector(5)};
  keyframe.v_odom_body = vector(2);
  Matrix6d A;
  for (double& a : A.reshaped()) {
    a = unit(rng);
  }
  keyframe.edge = OdometryEdge{
      11, {ExpSo3(vector(0.1)), vector(0.3)}, 1e-4 * (A * A.transpose() + Matrix6d::Identity())};
  keyframe.preintegration.emplace();
  keyframe.preintegration->duration_s = 0.25;
  keyframe.preintegration->covariance.setIdentity();
  for (int i = 0; i < 600; ++i) {
    Corner corner;
    corner.pixel = Eigen::Vector2f(unit(rng) * 751, unit(rng) * 479);
    corner.octave = static_cast<int8_t>(rng() % 8);
    corner.descriptor = RandomDescriptor(rng);
    corner.landmark_id = i < 120 ? i * 7 : kNoLandmark;
    keyframe.corners.push_back(corner);
  }
  for (int i = 0; i < 70; ++i) {
    keyframe.points.push_back({i, 0.2f + 0.01f * i, 0.001f});
  }
  return keyframe;
}

template <typename Message>
Message ThroughBytes(const Message& message) {
  std::vector<uint8_t> bytes = EncodeMessage(message);
  Message out;
  EXPECT_TRUE(DecodeMessage(bytes, &out));
  return out;
}

TEST(Messages, KeyframeRoundTrip) {
  const Keyframe in = RandomKeyframe(1);
  const auto parsed = Parse(ThroughBytes(ToMessage(in)));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  const Keyframe& out = *parsed.value;
  EXPECT_EQ(out.id, in.id);
  EXPECT_EQ(out.utime, in.utime);
  EXPECT_LT(out.T_odom_body.Minus(in.T_odom_body).norm(), 1e-12);
  EXPECT_LT((out.edge->covariance - in.edge->covariance).norm(), 1e-15);
  EXPECT_EQ(out.edge->from_seq, 11);
  ASSERT_EQ(out.corners.size(), in.corners.size());
  for (size_t i = 0; i < in.corners.size(); ++i) {
    EXPECT_LE((out.corners[i].pixel - in.corners[i].pixel).cwiseAbs().maxCoeff(), 1.0f / 32 + 1e-4);
    EXPECT_EQ(out.corners[i].descriptor, in.corners[i].descriptor);
    EXPECT_EQ(out.corners[i].landmark_id, in.corners[i].landmark_id);
    EXPECT_EQ(out.corners[i].octave, in.corners[i].octave);
  }
  ASSERT_EQ(out.points.size(), in.points.size());
  EXPECT_EQ(out.points[9].inverse_depth, in.points[9].inverse_depth);
}

// The older type is sent if it suffices, so that older programs can still read it.
TEST(Messages, AKeyframeSaysHowSureItsScaleAndExtrinsicsAre) {
  Keyframe in = RandomKeyframe(1);
  const size_t shipped = EncodeMessage(ToMessage(in)).size();
  keyframe_t plain{};
  EXPECT_TRUE(DecodeMessage(EncodeMessage(ToMessage(in)), &plain));
  EXPECT_EQ(plain.id.seq, in.id.seq);

  in.scale_sigma = 0.07;
  in.T_body_cam_covariance = 1e-6 * Matrix6d::Identity();
  in.T_body_cam_covariance(1, 3) = in.T_body_cam_covariance(3, 1) = 5e-7;
  const std::vector<uint8_t> bytes = EncodeMessage(ToMessage(in));
  EXPECT_EQ(bytes.size(), shipped + 37 * sizeof(double));
  EXPECT_FALSE(DecodeMessage(bytes, &plain));
  const auto out = Parse(ThroughBytes(ToMessage(in)));
  ASSERT_TRUE(out.value) << out.refused;
  EXPECT_EQ(out.value->scale_sigma, 0.07);
  EXPECT_EQ(out.value->T_body_cam_covariance, in.T_body_cam_covariance);
  EXPECT_EQ(out.value->corners.size(), in.corners.size());
}

// ORB's keyframes keep the older types.
TEST(Messages, AKeyframeSaysOfWhichKindItsDescriptorsAre) {
  Keyframe in = RandomKeyframe(1);
  in.scale_sigma = 0.07;
  const size_t with_errors = EncodeMessage(ToMessage(in)).size();
  in.descriptor_kind = DescriptorKind::kPatchNetwork;
  EXPECT_EQ(EncodeMessage(ToMessage(in)).size(), with_errors + 1);
  const auto out = Parse(ThroughBytes(ToMessage(in)));
  ASSERT_TRUE(out.value) << out.refused;
  EXPECT_EQ(out.value->descriptor_kind, DescriptorKind::kPatchNetwork);
  EXPECT_EQ(out.value->scale_sigma, 0.07);
  EXPECT_EQ(out.value->corners.size(), in.corners.size());
}

TagObservation TestTag(int id) {
  return {{TagFamily::k36h11, id}, {{{100.5F, 180.25F}, {180, 180}, {180, 100}, {100, 100.125F}}}};
}

TEST(Messages, AKeyframeHasTheTagsThatItSees) {
  Keyframe in = RandomKeyframe(1);
  in.descriptor_kind = DescriptorKind::kPatchNetwork;
  const size_t without = EncodeMessage(ToMessage(in)).size();
  in.tags = {TestTag(17), TestTag(586)};
  EXPECT_EQ(EncodeMessage(ToMessage(in)).size(), without + 1 + 2 * 37);
  const auto out = Parse(ThroughBytes(ToMessage(in)));
  ASSERT_TRUE(out.value) << out.refused;
  EXPECT_EQ(out.value->descriptor_kind, DescriptorKind::kPatchNetwork);
  ASSERT_EQ(out.value->tags.size(), 2u);
  EXPECT_EQ(out.value->tags[1].tag, in.tags[1].tag);
  EXPECT_EQ(out.value->tags[0].corners, in.tags[0].corners);
}

TEST(Messages, ATagOutOfBoundsIsRefused) {
  const auto refused = [](const auto& spoil) {
    Keyframe keyframe = RandomKeyframe(1);
    keyframe.tags = {TestTag(17), TestTag(18)};
    KeyframeMessage message = ToMessage(keyframe);
    spoil(&message);
    const auto out = Parse(ThroughBytes(message));
    EXPECT_FALSE(out.value);
    return out.refused;
  };
  using M = KeyframeMessage*;
  EXPECT_NE(refused([](M m) { m->tags[0].family = 2; }).find("family 2"), std::string::npos);
  EXPECT_NE(refused([](M m) { m->tags[0].id = 587; }).find("id 587"), std::string::npos);
  EXPECT_NE(refused([](M m) { m->tags[0].id = -1; }), "");
  EXPECT_NE(refused([](M m) { m->tags[0].u_px[2] = 5000; }).find("outside"), std::string::npos);
  EXPECT_NE(refused([](M m) { m->tags[0].u_px[2] = NAN; }).find("outside"), std::string::npos);
  EXPECT_NE(refused([](M m) { m->tags[0].id = 18; }).find("twice"), std::string::npos);
  EXPECT_NE(refused([](M m) { std::swap(m->tags[0].u_px, m->tags[0].v_px); }), "");
  EXPECT_NE(refused([](M m) { m->tags.resize(kMaxTags + 1, m->tags[0]); }).find("num_tags"),
            std::string::npos);
}

TEST(Messages, AKindOfDescriptorsThatNobodyKnowsIsNamed) {
  KeyframeMessage message = ToMessage(RandomKeyframe(1));
  for (const int kind : {-1, kNumDescriptorKinds, 100}) {
    message.descriptor_kind = static_cast<int8_t>(kind);
    const auto out = Parse(ThroughBytes(message));
    EXPECT_FALSE(out.value);
    EXPECT_NE(out.refused.find("descriptor_kind"), std::string::npos) << out.refused;
  }
}

// A keyframe with 600 corners, of which 120 are tracked, and 70 points.
TEST(Messages, KeyframeFitsItsBudget) {
  EXPECT_LE(ToMessage(RandomKeyframe(2)).getEncodedSize(), 28'000);
}

TEST(Messages, BadKeyframesAreRefusedWithAReason) {
  const KeyframeMessage good = ToMessage(RandomKeyframe(3));
  const double nan = std::nan("");
  const std::vector<std::function<void(KeyframeMessage*)>> damages = {
      [](KeyframeMessage* m) { m->id.map.agent_id = 0; },
      [](KeyframeMessage* m) { m->id.seq = -1; },
      [](KeyframeMessage* m) { m->utime = -5; },
      [&](KeyframeMessage* m) { m->camera.fx = nan; },
      [](KeyframeMessage* m) { m->camera.model = 9; },
      [](KeyframeMessage* m) { m->camera.cx = 1e300; },
      [&](KeyframeMessage* m) { m->camera.distortion[2] = -1e10; },
      [](KeyframeMessage* m) { m->camera.width = 1 << 20; },
      [](KeyframeMessage* m) { m->camera.readout_s = std::numeric_limits<double>::infinity(); },
      [&](KeyframeMessage* m) { m->v_odom_body.y = nan; },
      [](KeyframeMessage* m) { m->preintegration.bias_jacobian[3] = 1e200; },
      [](KeyframeMessage* m) { m->preintegration.duration_s = 1e-300; },
      [](KeyframeMessage* m) { m->num_corners = 701; },
      [](KeyframeMessage* m) { m->T_odom_body.rotation.w += 1; },
      [&](KeyframeMessage* m) { m->T_odom_body.translation.x = nan; },
      [](KeyframeMessage* m) { m->T_odom_body.translation.x = 1e9; },
      [](KeyframeMessage* m) { m->edge_covariance[0] = -1; },
      [](KeyframeMessage* m) { m->edge_covariance[1] += 1; },
      [](KeyframeMessage* m) { m->edge_from_seq = m->id.seq; },
      [&](KeyframeMessage* m) { m->preintegration.covariance[0] = nan; },
      [](KeyframeMessage* m) { m->u_16th_px[5] = 32000; },
      [](KeyframeMessage* m) { m->octave[5] = 100; },
      [](KeyframeMessage* m) { m->tracked_corner[0] = 9999; },
      [](KeyframeMessage* m) { m->point_corner[0] = -1; },
      [](KeyframeMessage* m) { m->inverse_depth[0] = -0.1f; },
      [&](KeyframeMessage* m) { m->inverse_depth_variance[0] = std::nanf(""); },
      [](KeyframeMessage* m) {
        m->num_descriptor_bytes = static_cast<int16_t>(m->num_descriptor_bytes - 32);
      },
      [](KeyframeMessage* m) { m->roll_pitch_covariance[0] = 0; },
      [&](KeyframeMessage* m) { m->scale_sigma = nan; },
      [](KeyframeMessage* m) { m->scale_sigma = 1.5; },
      [](KeyframeMessage* m) { m->T_body_cam_covariance[1] = 1e-6; },
  };
  ASSERT_TRUE(Parse(good).value) << Parse(good).refused;
  for (size_t i = 0; i < damages.size(); ++i) {
    KeyframeMessage bad = good;
    damages[i](&bad);
    const auto parsed = Parse(bad);
    EXPECT_FALSE(parsed.value) << "damage " << i;
    EXPECT_FALSE(parsed.refused.empty()) << "damage " << i;
  }
}

TEST(Messages, ConstraintRoundTripAndForgedId) {
  Constraint in;
  in.from = {{1, 100}, 4};
  in.to = {{2, 200}, 9};
  in.accepted = true;
  in.T_from_to = {ExpSo3({0.1, 0.2, 0.3}), {1, 2, 3}};
  in.covariance(0, 1) = in.covariance(1, 0) = 0.3;
  constraint_t message = ThroughBytes(ToMessage(in));
  const auto parsed = Parse(message);
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->Id(), in.Id());
  EXPECT_DOUBLE_EQ(parsed.value->covariance(0, 1), 0.3);
  const std::vector<std::function<void(constraint_t*)>> damages = {
      [](constraint_t* m) { m->id += 1; },
      [](constraint_t* m) { m->rms_px = std::nanf(""); },
      [](constraint_t* m) { m->inlier_ratio = std::numeric_limits<float>::infinity(); },
      [](constraint_t* m) { m->num_inliers = -1; },
      [](constraint_t* m) { m->kind = 7; },
      [](constraint_t* m) { m->T_from_to.translation.z = 1e30; },
      [](constraint_t* m) { m->covariance[7] = std::nan(""); },
      [](constraint_t* m) { m->to = m->from; },
  };
  for (size_t i = 0; i < damages.size(); ++i) {
    constraint_t bad = message;
    damages[i](&bad);
    EXPECT_FALSE(Parse(bad).refused.empty()) << "damage " << i;
  }
}

TEST(Messages, PlaceMatchRoundTrip) {
  PlaceMatch in;
  in.query = {{2, 200}, 9};
  in.candidates.push_back({{{1, 100}, 4}, PlaceKind::kInter, 0.5f, {{1, 2}, {3, 4}}});
  in.rejected = {"too few matches"};
  const auto parsed = Parse(ThroughBytes(ToMessage(in)));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  ASSERT_EQ(parsed.value->candidates.size(), 1u);
  EXPECT_EQ(parsed.value->candidates[0].corner_matches, in.candidates[0].corner_matches);
  EXPECT_EQ(parsed.value->rejected, in.rejected);
}

TEST(Messages, MapStateIsCutIntoChunks) {
  MapState in;
  in.group = {1, 100};
  in.revision = 3;
  in.maps = {{1, 100}, {2, 200}};
  for (int i = 0; i < 1234; ++i) {
    in.keyframes.push_back({{{1, 100}, i}, i * 1000, Rigid3()});
  }
  size_t total = 0;
  const auto messages = ToMessages(in);
  for (const map_state_t& message : messages) {
    EXPECT_LT(message.getEncodedSize(), 64'000);
    const auto parsed = Parse(ThroughBytes(message));
    ASSERT_TRUE(parsed.value) << parsed.refused;
    total += parsed.value->keyframes.size();
  }
  EXPECT_EQ(messages.size(), 3u);
  EXPECT_EQ(total, 1234u);
}

TEST(Messages, HaveAndResendRequestAreBounded) {
  have_t have{};
  have.num_maps = have.num_gaps = 1;
  have.maps = {ToMessage(MapId{1, 100})};
  have.highest_seq = {7};
  have.gaps.resize(1);
  have.gaps[0].map = have.maps[0];
  have.gaps[0].from_seq = 2;
  have.gaps[0].to_seq = 3;
  const auto parsed = Parse(ThroughBytes(have));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->highest_seq.at(0), std::pair(MapId{1, 100}, 7));
  EXPECT_EQ(parsed.value->gaps.at(0).to_seq, 3);
  const std::vector<std::function<void(have_t*)>> damages = {
      [](have_t* m) { m->highest_seq[0] = std::numeric_limits<int32_t>::max(); },
      [](have_t* m) { m->highest_seq[0] = -1; },
      [](have_t* m) { m->maps[0].agent_id = 0; },
      [](have_t* m) { m->gaps[0].to_seq = std::numeric_limits<int32_t>::max(); },
      [](have_t* m) { m->gaps[0].from_seq = 4; },
      [](have_t* m) { m->gaps[0].from_seq = -4; },
  };
  for (size_t i = 0; i < damages.size(); ++i) {
    have_t bad = have;
    damages[i](&bad);
    EXPECT_FALSE(Parse(bad).refused.empty()) << "damage " << i;
  }
  resend_request_t request{};
  request.requester = "fusion";
  request.map = ToMessage(MapId{1, 100});
  request.to_seq = std::numeric_limits<int32_t>::max();
  ASSERT_TRUE(Parse(request).value);
  EXPECT_LT(Parse(request).value->range.to_seq, 1 << 30);
  for (const char* name : {"", "a b", "AGAIN_0123456789012345678901234567890123456789"}) {
    request.requester = name;
    EXPECT_FALSE(Parse(request).refused.empty()) << name;
  }
}

TEST(Messages, VerificationRequestIsBounded) {
  verdict_request_t request{};
  request.requester = "posegraph";
  request.map = ToMessage(MapId{1, 100});
  request.num_verdicts = 2;
  request.seq = {7, 8};
  request.constraint_id = {-5, 6};
  const auto parsed = Parse(ThroughBytes(request));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->requester, "posegraph");
  EXPECT_EQ(parsed.value->names.map, (MapId{1, 100}));
  EXPECT_EQ(parsed.value->names.results.at(0), std::pair(7, int64_t{-5}));
  const std::vector<std::function<void(verdict_request_t*)>> damages = {
      [](verdict_request_t* m) { m->requester = "a b"; },
      [](verdict_request_t* m) { m->map.agent_id = 0; },
      [](verdict_request_t* m) { m->seq[1] = -1; },
      [](verdict_request_t* m) { m->seq[1] = std::numeric_limits<int32_t>::max(); },
      [](verdict_request_t* m) {
        m->num_verdicts = 501;
        m->seq.resize(501);
        m->constraint_id.resize(501);
      },
  };
  for (size_t i = 0; i < damages.size(); ++i) {
    verdict_request_t bad = request;
    damages[i](&bad);
    EXPECT_FALSE(Parse(bad).refused.empty()) << "damage " << i;
  }
}

TEST(Messages, CorrectionRoundTrip) {
  Correction in;
  in.map = {2, 200};
  in.group = {1, 100};
  in.revision = 7;
  in.T_map_odom = {YawRotation(1.0), {1, 2, 3}};
  const auto parsed = Parse(ThroughBytes(ToMessage(in)));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_LT(parsed.value->T_map_odom.Minus(in.T_map_odom).norm(), 1e-12);
}

MapLandmarks SomeLandmarks() {
  MapLandmarks in{{2, 200}, {1, 100}, 7, {{{{1, 100}, 5}, {1, 2, 3}}}, {}};
  for (int i = 0; i < 18; ++i) {
    in.landmarks.push_back({0, i, {4, 0.5 * i, 1}, 0.05, 0.01, {1, 2, 3, 1ULL << i}});
  }
  return in;
}

TEST(Messages, LandmarksRoundTrip) {
  const MapLandmarks in = SomeLandmarks();
  const auto parsed = Parse(ThroughBytes(ToMessage(in)));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  ASSERT_EQ(parsed.value->landmarks.size(), in.landmarks.size());
  EXPECT_EQ(parsed.value->sources.front().keyframe, in.sources.front().keyframe);
  EXPECT_EQ(parsed.value->landmarks[9].p_map, in.landmarks[9].p_map);
  EXPECT_EQ(parsed.value->landmarks[9].descriptor, in.landmarks[9].descriptor);
  EXPECT_EQ(parsed.value->landmarks[9].landmark_id, 9);
}

TEST(Messages, RefusesHostileLandmarks) {
  const auto refused = [](const std::function<void(landmarks_t&)>& spoil) {
    landmarks_t message = ToMessage(SomeLandmarks());
    spoil(message);
    return !Parse(message).value;
  };
  EXPECT_FALSE(refused([](landmarks_t&) {}));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.map.agent_id = 0; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.revision = 0; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.num_landmarks = -1; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.num_landmarks = 65; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.num_sources = 9; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.sources[0].p_map_cam[1] = NAN; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.sources[0].keyframe.seq = -1; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.landmarks[3].source = 1; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.landmarks[3].source = -1; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.landmarks[3].landmark_id = -2; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.landmarks[3].p_map[0] = INFINITY; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.landmarks[3].p_map[0] = 1e7f; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.landmarks[3].sigma_along_m = NAN; }));
  EXPECT_TRUE(refused([](landmarks_t& m) { m.landmarks[3].sigma_across_m = 0; }));
  EXPECT_TRUE(refused([](landmarks_t& m) {  // on its own source: no line of sight
    std::copy_n(m.sources[0].p_map_cam, 3, m.landmarks[3].p_map);
  }));
}

TEST(Messages, OptionsAreBoundedAndNamed) {
  options_t message{};
  message.process = "inter_map_ba";
  message.utime = 7;
  message.yaml = "min_inliers: 20\n";
  const auto parsed = Parse(ThroughBytes(message));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->yaml, message.yaml);
  EXPECT_EQ(parsed.value->utime, 7);
  for (const std::string& name : {std::string(), std::string("../fusion"), std::string(51, 'a')}) {
    options_t bad = message;
    bad.process = name;
    EXPECT_FALSE(Parse(bad).value) << name;
  }
  message.yaml.assign(16'001, 'x');
  EXPECT_FALSE(Parse(message).value);
}

}  // namespace
}  // namespace pangea

#include "link/wire.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

namespace pangea {
namespace {

using testing::HasSubstr;

LinkHello SomeHello() {
  return {"test", {{{2, 100}, 0, 0, 0}, {{2, 200}, 70'000, int64_t{1} << 40, 1}}};
}

LinkAck SomeAck() {
  LinkAck ack;
  ack.highest_number = int64_t{1} << 33;
  ack.cache_bytes = 1000;
  ack.journalled_seq = {{{2, 100}, -1}, {{2, 200}, 9}};
  ack.partial[{{2, 200}, 10}] = {0xFF, 0x01};
  Correction correction;
  correction.map = {2, 200};
  correction.group = {1, 50};
  correction.revision = 3;
  ack.corrections.push_back(correction);
  return ack;
}

pose_t SomePose() {
  pose_t pose{};
  pose.utime = 123'456'789;
  pose.state = pose_t::STATE_TRACKING;
  pose.map = ToMessage(MapId{2, 100});
  const Eigen::Quaterniond q(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()));
  pose.T_odom_body = ToMessage(Rigid3(q, {1.25, -20, 300}));
  pose.T_map_body = ToMessage(Rigid3(q, {1, 2, 3}));
  pose.v_odom_body = ToMessage(Eigen::Vector3d(1, 2, 3));
  pose.group_revision = 9;
  pose.num_tracked = 130;
  return pose;
}

Parsed<LinkAck> ParseAckBody(int32_t agent_id, std::vector<uint8_t> body) {
  return ParseAck(agent_id, {LinkKind::kAck, 1, std::move(body)});
}

TEST(Wire, WhatExceedsAFrameHasAHeaderForEachPart) {
  const auto on_the_wire = [](size_t size) {
    return BytesOnTheWire("LINK_UP_1", std::vector<uint8_t>(size));
  };
  constexpr size_t kFull = 1500 - 20 - 8 - 8 - sizeof("LINK_UP_1");
  EXPECT_EQ(on_the_wire(kFull), 1500);
  EXPECT_EQ(on_the_wire(kFull + 1), 1501 + 20);
  EXPECT_EQ(on_the_wire(4096), 4096 + 3 * 20 + 8 + 8 + 10);
}

TEST(Wire, HelloRoundTrip) {
  const auto parsed = ParseHello(2, Encode(SomeHello()));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->software, "test");
  ASSERT_EQ(parsed.value->maps.size(), 2u);
  const LinkMap& map = parsed.value->maps[1];
  EXPECT_EQ(map.map, (MapId{2, 200}));
  EXPECT_EQ(map.first_seq, 70'000);
  EXPECT_EQ(map.correction_revision, int64_t{1} << 40);
  EXPECT_EQ(map.slot, 1);
}

TEST(Wire, AbsurdHellosAreRefused) {
  LinkHello twice = SomeHello();
  twice.maps[1].slot = 0;
  EXPECT_THAT(ParseHello(2, Encode(twice)).refused, HasSubstr("slot"));
  LinkHello early = SomeHello();
  early.maps[0].map.opened_utime = -1;
  EXPECT_FALSE(ParseHello(2, Encode(early)).value);
  LinkHello many;
  many.maps.resize(kMaxLinkMaps + 1);
  EXPECT_FALSE(ParseHello(2, Encode(many)).value);
  LinkHello clears_the_screen = SomeHello();
  clears_the_screen.software = "\x1b[2J";
  EXPECT_THAT(ParseHello(2, Encode(clears_the_screen)).refused, HasSubstr("printable"));
  LinkHello far = SomeHello();
  far.maps[0].first_seq = 20'000'000;
  EXPECT_FALSE(ParseHello(2, Encode(far)).value);
}

TEST(Wire, PieceRoundTrip) {
  const std::vector<uint8_t> data(1000, 3);
  for (const bool last : {false, true}) {
    const LinkPacket packet{last ? LinkKind::kLastPiece : LinkKind::kPiece, 1,
                            Encode(LinkPiece{5, 0xAB, 7, last, data})};
    EXPECT_EQ(packet.body.size(), data.size() + kPieceHeaderBytes);
    const auto parsed = ParsePiece(packet);
    ASSERT_TRUE(parsed.value) << parsed.refused;
    EXPECT_EQ(parsed.value->slot, 5);
    EXPECT_EQ(parsed.value->seq_low, 0xAB);
    EXPECT_EQ(parsed.value->index, 7);
    EXPECT_EQ(parsed.value->last, last);
    EXPECT_TRUE(std::equal(data.begin(), data.end(), parsed.value->data.begin()));
  }
}

TEST(Wire, AbsurdPiecesAreRefused) {
  const std::vector<uint8_t> data(kMaxPayloadBytes + 1);
  const auto refused = [](const LinkPiece& piece) {
    return !ParsePiece({LinkKind::kPiece, 1, Encode(piece)}).value;
  };
  EXPECT_TRUE(refused({0, 0, 0, false, {}}));
  EXPECT_TRUE(refused({0, 0, 0, false, data}));
  EXPECT_TRUE(refused({0, 0, 255, false, Bytes(data).first(1)}));
  EXPECT_FALSE(ParsePiece({LinkKind::kPiece, 1, {1, 2}}).value);
}

TEST(Wire, PoseRoundTripInSinglePrecision) {
  const pose_t pose = SomePose();
  const std::vector<uint8_t> body = EncodePose(pose);
  EXPECT_LT(body.size(), 100u);
  const auto parsed = ParsePose(2, body);
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->utime, pose.utime);
  EXPECT_EQ(parsed.value->map.agent_id, 2);
  EXPECT_EQ(parsed.value->map.opened_utime, 100);
  EXPECT_NEAR(parsed.value->T_odom_body.translation.z, 300, 1e-4);
  EXPECT_NEAR(parsed.value->T_odom_body.rotation.x, pose.T_odom_body.rotation.x, 1e-7);
  EXPECT_EQ(parsed.value->v_odom_body.y, 2);
  EXPECT_EQ(parsed.value->group_revision, 9);
  EXPECT_EQ(parsed.value->num_tracked, 130);
}

TEST(Wire, APoseThatIsNoTransformIsRefusedWhileTracking) {
  pose_t pose = SomePose();
  pose.T_odom_body.rotation.w = 5;
  EXPECT_FALSE(ParsePose(2, EncodePose(pose)).value);
  pose.state = pose_t::STATE_INITIALISING;
  pose.reason = "it stands still";
  const auto parsed = ParsePose(2, EncodePose(pose));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->reason, pose.reason);
}

TEST(Wire, AbsurdPosesAreRefused) {
  const auto refused = [](const std::function<void(pose_t*)>& damage) {
    pose_t pose = SomePose();
    damage(&pose);
    return ParsePose(2, EncodePose(pose)).refused;
  };
  EXPECT_EQ(refused([](pose_t*) {}), "");
  EXPECT_THAT(refused([](pose_t* p) { p->v_odom_body.y = std::nan(""); }), HasSubstr("velocity"));
  EXPECT_THAT(refused([](pose_t* p) { p->v_odom_body.y = 1e6; }), HasSubstr("velocity"));
  EXPECT_THAT(refused([](pose_t* p) { p->utime = -1; }), HasSubstr("time"));
  EXPECT_THAT(refused([](pose_t* p) { p->utime = std::numeric_limits<int64_t>::max(); }),
              HasSubstr("time"));
  EXPECT_THAT(refused([](pose_t* p) { p->state = 77; }), HasSubstr("state"));
  EXPECT_THAT(refused([](pose_t* p) { p->reason = "\x1b[2J"; }), HasSubstr("printable"));
}

TEST(Wire, APoseBeforeTrackingIsNowhere) {
  pose_t pose = SomePose();
  pose.state = pose_t::STATE_INITIALISING;
  pose.T_odom_body.translation.x = std::nan("");
  const auto parsed = ParsePose(2, EncodePose(pose));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->T_odom_body.translation.x, 0);
  EXPECT_EQ(parsed.value->T_map_body.translation.x, 0);
}

TEST(Wire, AckRoundTripAndRefusal) {
  LinkAck ack = SomeAck();
  const auto parsed = ParseAckBody(2, Encode(ack));
  ASSERT_TRUE(parsed.value) << parsed.refused;
  EXPECT_EQ(parsed.value->highest_number, ack.highest_number);
  EXPECT_EQ(parsed.value->journalled_seq, ack.journalled_seq);
  EXPECT_EQ(parsed.value->partial, ack.partial);
  EXPECT_EQ(parsed.value->corrections[0].revision, 3);
  EXPECT_FALSE(ParseAckBody(1, Encode(ack)).value) << "a correction of another agent's map";
  ack.cache_bytes = 0;
  EXPECT_FALSE(ParseAckBody(2, Encode(ack)).value);
}

// A faulty agent can seal any bytes correctly. Such packets must not cause a crash, and truncated
// ones are refused.
TEST(Wire, DamagedBodiesAreRefusedOrBounded) {
  const std::vector<std::vector<uint8_t>> bodies = {Encode(SomeHello()), Encode(SomeAck()),
                                                    EncodePose(SomePose())};
  const auto parse = [](size_t which, const std::vector<uint8_t>& body) {
    switch (which) {
      case 0:
        return ParseHello(2, body).value.has_value();
      case 1:
        return ParseAckBody(2, body).value.has_value();
      default:
        return ParsePose(2, body).value.has_value();
    }
  };
  std::mt19937_64 rng(5);
  for (size_t which = 0; which < bodies.size(); ++which) {
    ASSERT_TRUE(parse(which, bodies[which]));
    for (size_t size = 0; size < bodies[which].size(); ++size) {
      EXPECT_FALSE(parse(which, {bodies[which].begin(),
                                 bodies[which].begin() + static_cast<std::ptrdiff_t>(size)}));
    }
    for (int i = 0; i < 20'000; ++i) {
      std::vector<uint8_t> body = bodies[which];
      for (int flips = 0; flips < 3; ++flips) {
        body[rng() % body.size()] ^= static_cast<uint8_t>(1 + rng() % 255);
      }
      parse(which, body);
    }
  }
}

}  // namespace
}  // namespace pangea

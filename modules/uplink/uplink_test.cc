#include "uplink/uplink.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <map>
#include <set>

#include "uplink/test_ids.h"

namespace pangea {
namespace {

LinkAck Ack(int64_t number, int32_t journalled, const MapId& map = kMap) {
  LinkAck ack;
  ack.number = number;
  ack.cache_bytes = 210 * 1024;
  ack.journalled_seq[map] = journalled;
  return ack;
}

std::vector<int> SentSeqs(const std::vector<LinkPacket>& packets) {
  std::vector<int> seqs;
  for (const LinkPacket& packet : packets) {
    if (packet.kind == LinkKind::kLastPiece) {  // they have one piece
      seqs.push_back(ParsePiece(packet).value->seq_low);
    }
  }
  return seqs;
}

LinkHello HelloIn(const std::vector<LinkPacket>& packets) {
  for (const LinkPacket& packet : packets) {
    if (packet.kind == LinkKind::kHello) {
      return *ParseHello(1, packet.body).value;
    }
  }
  ADD_FAILURE() << "no hello";
  return {};
}

class UplinkTest : public testing::Test {
 protected:
  void Add(int32_t seq, int64_t now = 0) {
    uplink.AddKeyframe({kMap, seq}, std::vector<uint8_t>(500), now);
  }
  Uplink uplink{UplinkOptions{}};
};

TEST_F(UplinkTest, KeepsTryingWithHellosOnlyWhileTheHandlerIsAway) {
  Add(0);
  int hellos = 0;
  for (int64_t now = 0; now < 10 * kSecond; now += 10'000) {
    const auto packets = uplink.Poll(now);
    EXPECT_TRUE(SentSeqs(packets).empty());
    hellos += static_cast<int>(packets.size());
  }
  EXPECT_GE(hellos, 9);
  EXPECT_LE(hellos, 41);
  uplink.OnAck(Ack(1, -1), 10 * kSecond);
  EXPECT_THAT(SentSeqs(uplink.Poll(10 * kSecond)), testing::ElementsAre(0));
}

// The process polls 250 times a second while it is paced, which a phone's battery pays.
TEST_F(UplinkTest, IsPacedOnlyUntilAllPiecesAreSent) {
  Uplink slow({.sender = {.bandwidth_kb_per_s = 10}});
  slow.AddKeyframe({kMap, 0}, std::vector<uint8_t>(30'000), 0);
  slow.Poll(0);
  EXPECT_FALSE(slow.sender().Paced()) << "the handler is away";
  slow.OnAck(Ack(1, -1), kSecond);
  slow.Poll(kSecond);
  EXPECT_TRUE(slow.sender().Paced());
  slow.OnAck(Ack(2, -1), 2 * kSecond);
  slow.Poll(2 * kSecond);
  EXPECT_FALSE(slow.sender().Paced()) << "it waits for the acknowledgement";
  EXPECT_EQ(slow.sender().spooled(), 1u);
}

TEST_F(UplinkTest, WhatTheJournalHasIsReleased) {
  for (int seq = 0; seq < 5; ++seq) {
    Add(seq);
  }
  uplink.OnAck(Ack(1, 2), kSecond);
  EXPECT_EQ(uplink.Acknowledged().at(kMap), 2);
  EXPECT_EQ(uplink.sender().spooled(), 2u);
  EXPECT_EQ(uplink.keyframes_acked(), 3);
  EXPECT_EQ(uplink.AddKeyframe({kMap, 1}, {1}, 0), Uplink::Taken::kRepeat);
}

// An uplink started late hears keyframe 7 first.
TEST_F(UplinkTest, AsksTheOdometryForWhatItMissed) {
  Add(7);
  auto asks = uplink.Asks(kSecond);
  ASSERT_EQ(asks.size(), 1u);
  EXPECT_EQ(asks[0].gap.from_seq, 0);
  EXPECT_EQ(asks[0].gap.to_seq, 6);
  uplink.OnAck(Ack(1, 4), kSecond);
  EXPECT_TRUE(SentSeqs(uplink.Poll(kSecond)).empty()) << "never out of order";
  asks = uplink.Asks(2 * kSecond);
  ASSERT_GE(asks.size(), 1u);
  EXPECT_EQ(asks[0].gap.from_seq, 5);
  Add(5);
  Add(6);
  EXPECT_THAT(SentSeqs(uplink.Poll(2 * kSecond)), testing::ElementsAre(5, 6, 7));
}

// The last keyframe's datagram was lost, or the uplink has just started: nothing shows it.
TEST_F(UplinkTest, ProbesForALostTail) {
  uplink.AddPose(kMap, 0, {1});
  const auto asks = uplink.Asks(3 * kSecond);
  ASSERT_GE(asks.size(), 1u);
  EXPECT_EQ(asks[0].gap.map, kMap);
  EXPECT_EQ(asks[0].gap.from_seq, 0);
  EXPECT_TRUE(uplink.Asks(3 * kSecond + 500'000).empty());
}

// Keyframes that it may have missed in earlier maps are requested too, but only a few times.
TEST_F(UplinkTest, LooksAFewTimesWhatCameBeforeTheNewestMap) {
  Add(4);
  uplink.AddKeyframe({{1, 5000}, 0}, std::vector<uint8_t>(500), 0);
  for (int seq = 0; seq < 4; ++seq) {
    Add(seq);
  }
  std::map<MapId, int> probes;
  for (int64_t now = kSecond; now < 60 * kSecond; now += 10'000) {
    for (const Uplink::Ask& ask : uplink.Asks(now)) {
      EXPECT_FALSE(ask.known);
      EXPECT_EQ(ask.gap.from_seq, ask.gap.map == kMap ? 5 : ask.gap.map.opened_utime == 0 ? 0 : 1);
      ++probes[ask.gap.map];
    }
  }
  EXPECT_EQ(probes[kMap], 3);
  EXPECT_EQ((probes[{1, 0}]), 3);
  EXPECT_GT((probes[{1, 5000}]), 50);
  Add(5, 60 * kSecond);
  int again = 0;
  for (int64_t now = 60 * kSecond; now < 70 * kSecond; now += 10'000) {
    for (const Uplink::Ask& ask : uplink.Asks(now)) {
      again += ask.gap.map == kMap ? 1 : 0;
    }
  }
  EXPECT_EQ(again, 3);
}

TEST_F(UplinkTest, GivesUpWhatNobodyHas) {
  Add(3);
  int64_t now = 0;
  for (int i = 1; i < 60; ++i) {
    now += kSecond / 2;
    uplink.OnAck(Ack(i, -1), now);
    uplink.Asks(now);
  }
  EXPECT_EQ(uplink.keyframes_lost(), 3);
  const auto packets = uplink.Poll(now);
  EXPECT_EQ(HelloIn(packets).maps[0].first_seq, 3);
  EXPECT_THAT(SentSeqs(packets), testing::ElementsAre(3));
}

// A handler that comes back without its journal: the odometry may still have it all.
TEST_F(UplinkTest, AHandlerWithLessIsServedAnew) {
  for (int seq = 0; seq < 3; ++seq) {
    Add(seq);
  }
  uplink.OnAck(Ack(1, 2), kSecond);
  EXPECT_EQ(uplink.sender().spooled(), 0u);
  uplink.OnNewSession();
  uplink.OnAck(Ack(1, -1), 2 * kSecond);
  const auto asks = uplink.Asks(3 * kSecond);
  ASSERT_GE(asks.size(), 1u);
  EXPECT_EQ(asks[0].gap.from_seq, 0);
  EXPECT_EQ(asks[0].gap.to_seq, 2);
  EXPECT_EQ(HelloIn(uplink.Poll(3 * kSecond)).maps[0].first_seq, 0);
}

TEST_F(UplinkTest, OvertakenAcksChangeNothing) {
  for (int seq = 0; seq < 3; ++seq) {
    Add(seq);
  }
  uplink.OnAck(Ack(5, 0), kSecond);
  uplink.OnAck(Ack(4, 1), kSecond);
  EXPECT_EQ(uplink.Acknowledged().at(kMap), 0);
}

// Pieces name their map by its slot in the hello.
TEST_F(UplinkTest, EveryMapHasASlotOfItsOwn) {
  const MapId later{1, 2000};
  Add(0);
  uplink.AddKeyframe({later, 0}, std::vector<uint8_t>(500), 0);
  const LinkHello hello = HelloIn(uplink.Poll(0));
  ASSERT_EQ(hello.maps.size(), 2u);
  EXPECT_NE(hello.maps[0].slot, hello.maps[1].slot);
  LinkAck ack = Ack(1, 0);
  ack.journalled_seq[later] = -1;
  uplink.OnAck(ack, kSecond);
  for (const LinkPacket& packet : uplink.Poll(kSecond)) {
    if (packet.kind == LinkKind::kLastPiece) {
      EXPECT_EQ(ParsePiece(packet).value->slot, hello.maps[1].slot);
    }
  }
}

TEST_F(UplinkTest, TheHighestCorrectionWinsAndIsConfirmed) {
  LinkAck ack = Ack(1, -1);
  Correction correction;
  correction.map = kMap;
  correction.revision = 4;
  ack.corrections = {correction};
  uplink.OnAck(ack, kSecond);
  ack.number = 2;
  ack.corrections[0].revision = 3;
  uplink.OnAck(ack, kSecond);
  const auto told = uplink.TakeCorrections(kSecond);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].revision, 4);
  EXPECT_EQ(HelloIn(uplink.Poll(2 * kSecond)).maps[0].correction_revision, 4);
  EXPECT_TRUE(uplink.TakeCorrections(kSecond + 1).empty());
  EXPECT_EQ(uplink.TakeCorrections(3 * kSecond).size(), 1u) << "not applied yet";
  uplink.AddPose(kMap, 4, {1});
  EXPECT_TRUE(uplink.TakeCorrections(9 * kSecond).empty());
}

TEST(UplinkSpool, WhatIsStoredLeavesMemoryAndIsLoadedWhenItsTurnComes) {
  constexpr int kKeyframes = 400;
  constexpr size_t kBytes = 50'000;
  std::vector<int> loaded;
  Uplink uplink({}, [&](const KeyframeId& id) {
    loaded.push_back(id.seq);
    return id.seq == 250 ? std::vector<uint8_t>() : std::vector<uint8_t>(kBytes);
  });
  for (int seq = 0; seq < kKeyframes; ++seq) {
    uplink.AddKeyframe({kMap, seq}, std::vector<uint8_t>(kBytes), 0);
    uplink.SetStored({kMap, seq});
  }
  EXPECT_LE(uplink.sender().spooled_bytes(), Sender::kMaxStoredInMemory + int64_t{kBytes});
  EXPECT_EQ(uplink.sender().spooled(), 400u);
  uplink.OnAck(Ack(1, 199), kSecond);
  uplink.Poll(kSecond);
  EXPECT_EQ(loaded[0], 200);
  EXPECT_LE(loaded.size(), 4u) << "no more than the receiver has room for";
  // One that cannot be read is asked of the odometry.
  uplink.OnAck(Ack(2, 249), 2 * kSecond);
  uplink.Poll(2 * kSecond);
  const auto asks = uplink.Asks(3 * kSecond);
  ASSERT_GE(asks.size(), 1u);
  EXPECT_EQ(asks[0].gap.from_seq, 250);
  EXPECT_EQ(asks[0].gap.to_seq, 250);
}

TEST(UplinkSpool, SmallMemoryDoesNotBoundWhatTheDiskTakes) {
  UplinkOptions options;
  options.sender.max_spool_bytes = 1'000'000;
  Uplink uplink(options, [](const KeyframeId&) { return std::vector<uint8_t>(50'000); });
  for (int seq = 0; seq < 100; ++seq) {
    ASSERT_EQ(uplink.AddKeyframe({kMap, seq}, std::vector<uint8_t>(50'000), 0), Uplink::Taken::kNew)
        << seq;
    uplink.SetStored({kMap, seq});
  }
}

TEST(UplinkSpool, AnEarlierRunsKeyframesAreAnnouncedAndSent) {
  Uplink uplink({}, [](const KeyframeId&) { return std::vector<uint8_t>(500); });
  uplink.SetStored({kMap, 7});
  uplink.SetStored({kMap, 8});
  EXPECT_EQ(HelloIn(uplink.Poll(kSecond)).maps.size(), 1u);
  uplink.OnAck(Ack(1, 6), kSecond);
  EXPECT_THAT(SentSeqs(uplink.Poll(kSecond)), testing::ElementsAre(7, 8));
}

TEST_F(UplinkTest, TheNewestMapGoesFirst) {
  const MapId newer{1, 2000};
  Add(0);
  Add(1);
  uplink.AddKeyframe({newer, 5}, std::vector<uint8_t>(500), 0);
  LinkAck ack = Ack(1, -1);
  ack.journalled_seq[newer] = 4;
  uplink.OnAck(ack, kSecond);
  EXPECT_THAT(SentSeqs(uplink.Poll(kSecond)), testing::ElementsAre(5, 0, 1));
}

// The clock was set back, and the odometry's new map has a lower id than its old one.
TEST_F(UplinkTest, TheMapOfThePosesGoesFirst) {
  Correction correction;
  correction.revision = 1;
  LinkAck ack = Ack(1, -1);
  for (const MapId& map : {kLaterMap, kMap}) {
    uplink.AddPose(map, 0, {1});
    uplink.AddKeyframe({map, map == kMap ? 0 : 7}, std::vector<uint8_t>(500), 0);
    ack.journalled_seq[map] = map == kMap ? -1 : 6;
    correction.map = map;
    ack.corrections.push_back(correction);
  }
  EXPECT_EQ(HelloIn(uplink.Poll(kSecond)).maps.back().map, kMap);
  uplink.OnAck(ack, kSecond);
  EXPECT_THAT(SentSeqs(uplink.Poll(kSecond)), testing::ElementsAre(0, 7));
  EXPECT_EQ(uplink.TakeCorrections(kSecond).size(), 2u);
  const auto again = uplink.TakeCorrections(3 * kSecond);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].map, kMap);
  std::map<MapId, int> probes;
  for (int64_t now = 3 * kSecond; now < 60 * kSecond; now += 10'000) {
    for (const Uplink::Ask& ask : uplink.Asks(now)) {
      ++probes[ask.gap.map];
    }
  }
  EXPECT_GT(probes[kMap], 50) << "its end may be lost at any time";
}

TEST_F(UplinkTest, TheMapOfThePosesIsNotForgotten) {
  for (int i = 1; i < 300; ++i) {
    uplink.AddPose({1, 1'000'000 + i}, 0, {1});
  }
  uplink.AddPose(kMap, 0, {1});
  Add(0);
  uplink.OnAck(Ack(1, 0), kSecond);
  uplink.SetStored({{1, 2'000'000}, 0});
  EXPECT_EQ(uplink.Acknowledged().at(kMap), 0);
}

TEST_F(UplinkTest, PosesGoUpAtTenHertz) {
  int poses = 0;
  for (int i = 1; i <= 300; ++i) {
    const int64_t now = int64_t{10'000} * i;
    uplink.AddPose(kMap, 0, {1, 2, 3});
    uplink.OnAck(Ack(i, -1), now);
    for (const LinkPacket& packet : uplink.Poll(now)) {
      poses += packet.kind == LinkKind::kPose ? 1 : 0;
    }
  }
  EXPECT_GE(poses, 29);
  EXPECT_LE(poses, 31);
}

TEST_F(UplinkTest, ManyMapsStayBounded) {
  for (int i = 1; i < 5000; ++i) {
    uplink.AddPose({1, i}, 0, {1});
  }
  EXPECT_LE(uplink.Acknowledged().size(), 201u);
  EXPECT_LE(HelloIn(uplink.Poll(kSecond)).maps.size(), 20u);
}

// More maps than there are slots wait to be sent: a hello with a slot twice would be refused.
TEST(UplinkSpool, HundredsOfUnsentMapsAreAnnouncedAFewAtATime) {
  constexpr int kMaps = 400;
  Uplink uplink({}, [](const KeyframeId&) { return std::vector<uint8_t>(500); });
  for (int i = 1; i <= kMaps; ++i) {
    uplink.SetStored({{1, i}, 0});
  }
  std::array<MapId, 256> of_slot;  // as the handler understands it
  std::set<MapId> sent;
  for (int round = 1; round < kMaps && uplink.sender().spooled() > 0; ++round) {
    LinkAck ack = Ack(round, -1);
    ack.journalled_seq.clear();
    for (const LinkPacket& packet : uplink.Poll(round * kSecond)) {
      if (packet.kind == LinkKind::kHello) {
        const auto hello = ParseHello(1, packet.body);
        ASSERT_TRUE(hello.value) << hello.refused << " in round " << round;
        for (const LinkMap& map : hello.value->maps) {
          of_slot[map.slot] = map.map;
          ack.journalled_seq[map.map] = sent.contains(map.map) ? 0 : -1;
        }
      } else {
        sent.insert(of_slot[ParsePiece(packet).value->slot]);
      }
    }
    uplink.OnAck(ack, round * kSecond);
  }
  EXPECT_EQ(uplink.sender().spooled(), 0u);
  EXPECT_EQ(sent.size(), size_t{kMaps});
}

// ... and an old one that the journal knows is not sent before a hello has named it.
TEST(UplinkSpool, AMapOfTheJournalWaitsForItsSlot) {
  Uplink uplink({}, [](const KeyframeId&) { return std::vector<uint8_t>(500); });
  for (int i = 1; i <= 100; ++i) {
    uplink.SetStored({{1, i}, 0});
    uplink.SetStored({{1, i}, 1});
  }
  LinkAck ack = Ack(1, -1);
  ack.journalled_seq = {{{1, 5}, 0}};
  uplink.OnAck(ack, kSecond);
  EXPECT_EQ(uplink.keyframes_acked(), 1);
  EXPECT_THAT(SentSeqs(uplink.Poll(kSecond)), testing::IsEmpty());
}

// Looking through all of it at each poll, four milliseconds apart, would take a whole core.
TEST(UplinkSpool, HoursOfKeyframesCostAPollNothing) {
  Uplink uplink({}, [](const KeyframeId&) { return std::vector<uint8_t>(500); });
  for (int seq = 0; seq < 50'000; ++seq) {
    uplink.SetStored({kMap, seq});
  }
  const auto begin = std::chrono::steady_clock::now();
  for (int64_t now = 1; now <= 250; ++now) {
    uplink.Poll(now * 4000);
    EXPECT_TRUE(uplink.Asks(now * 4000).empty());
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(200));
}

}  // namespace
}  // namespace pangea

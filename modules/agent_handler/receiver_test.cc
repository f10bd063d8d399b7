#include "agent_handler/receiver.h"

#include <gtest/gtest.h>

#include "link/test_content.h"

namespace pangea {
namespace {

int PiecesOf(const KeyframeId& id) {
  return NumPieces(static_cast<int>(Content(id).size()), kFramePayloadBytes);
}

std::string AddPiece(Receiver* receiver, const KeyframeId& id, int index, bool spoiled = false) {
  std::vector<uint8_t> content = Content(id);
  content[static_cast<size_t>(index) * kFramePayloadBytes] ^= spoiled ? 1 : 0;
  const Bytes data = Piece(content, kFramePayloadBytes, index);
  return receiver->Add(id.map,
                       {0, static_cast<uint8_t>(id.seq), index, index == PiecesOf(id) - 1, data});
}

void AddAll(Receiver* receiver, const KeyframeId& id) {
  for (int i = 0; i < PiecesOf(id); ++i) {
    AddPiece(receiver, id, i);
  }
}

TEST(Receiver, RefusesPiecesThatNoHelloAnnounced) {
  Receiver receiver({}, CheckContent);
  EXPECT_NE(AddPiece(&receiver, {kMap, 0}, 0), "");
  receiver.OnHello({"", {{kMap, 0, 0}}});
  EXPECT_EQ(AddPiece(&receiver, {kMap, 0}, 0), "");
  EXPECT_NE(AddPiece(&receiver, {kMap, 100}, 0), "");
  receiver.OnNewUplink();
  EXPECT_NE(AddPiece(&receiver, {kMap, 0}, 0), "");
}

TEST(Receiver, ANewUplinkMayCutAKeyframeIntoOtherPieces) {
  Receiver receiver({}, CheckContent);
  receiver.OnHello({"", {{kMap, 0, 0}}});
  const auto content = Content({kMap, 0});
  receiver.Add(kMap, {0, 0, 0, false, Piece(content, 1000, 0)});
  EXPECT_EQ(receiver.cached_bytes(), 1000);
  receiver.OnNewUplink();
  EXPECT_EQ(receiver.cached_bytes(), 0);
  receiver.OnHello({"", {{kMap, 0, 0}}});
  AddAll(&receiver, {kMap, 0});
  const auto ready = receiver.TakeReady();
  ASSERT_EQ(ready.size(), 1u);
  EXPECT_EQ(ready[0].bytes, content);
}

TEST(Receiver, AKeyframeOfInconsistentPiecesIsDroppedAndComesAgain) {
  Receiver receiver({}, CheckContent);
  receiver.OnHello({"", {{kMap, 0, 0}}});
  const std::vector<uint8_t> data(100);
  AddPiece(&receiver, {kMap, 0}, 2);
  EXPECT_NE(receiver.Add(kMap, {0, 0, 1, true, data}), "")
      << "the last, though a later one is there";
  receiver.Add(kMap, {0, 0, 1, true, data});
  EXPECT_NE(AddPiece(&receiver, {kMap, 0}, 1 + 1), "") << "one after the last";
  EXPECT_EQ(receiver.cached_bytes(), 0);
  // A piece with another content spoils the keyframe, which then is taken when it comes again.
  EXPECT_EQ(AddPiece(&receiver, {kMap, 0}, 0, true), "");
  AddAll(&receiver, {kMap, 0});
  EXPECT_TRUE(receiver.TakeReady().empty());
  AddAll(&receiver, {kMap, 0});
  EXPECT_EQ(receiver.TakeReady().size(), 1u);
}

TEST(Receiver, AKeyframeWithoutALastPieceIsRefusedAtTheSizeLimit) {
  Receiver receiver({}, CheckContent);
  receiver.OnHello({"", {{kMap, 0, 0}}});
  const std::vector<uint8_t> data(kMaxPayloadBytes);
  EXPECT_EQ(receiver.Add(kMap, {0, 0, 0, false, data}), "");
  EXPECT_EQ(receiver.Add(kMap, {0, 0, 1, false, data}), "");
  EXPECT_NE(receiver.Add(kMap, {0, 0, 2, false, data}), "");
  EXPECT_EQ(receiver.cached_bytes(), 0);
}

// Only the low byte of a seq travels.
TEST(Receiver, SeqsBeyond255AreInOrder) {
  Receiver receiver({}, CheckContent);
  receiver.Resume(kMap, 254);
  receiver.OnHello({"", {{kMap, 0, 0}}});
  for (const int seq : {257, 250, 256, 255}) {
    AddAll(&receiver, {kMap, seq});
  }
  std::vector<int32_t> seqs;
  for (const auto& keyframe : receiver.TakeReady()) {
    seqs.push_back(keyframe.id.seq);
  }
  EXPECT_EQ(seqs, (std::vector<int32_t>{255, 256, 257}));
}

// The journal lost some in its middle: they come first, and nothing twice.
TEST(Receiver, FillsGapsBeforeItGoesOn) {
  Receiver receiver({}, CheckContent);
  receiver.Resume(kMap, 400, {{kMap, 3, 4}, {kMap, 300, 300}});
  receiver.OnHello({"", {{kMap, 0, 0}}});
  const auto journalled = [&] {
    LinkAck ack;
    receiver.FillAck(true, &ack);
    return ack.journalled_seq.at(kMap);
  };
  const auto take = [&](const std::vector<int32_t>& seqs) {
    for (const int32_t seq : seqs) {
      AddAll(&receiver, {kMap, seq});
    }
    std::vector<int32_t> taken;
    for (const auto& keyframe : receiver.TakeReady()) {
      taken.push_back(keyframe.id.seq);
    }
    return taken;
  };
  EXPECT_EQ(journalled(), 2);
  EXPECT_EQ(take({3, 4, 5, 6}), (std::vector<int32_t>{3, 4}));
  receiver.Journalled({kMap, 3});
  EXPECT_EQ(journalled(), 3) << "4 is not on the disk yet";
  receiver.Journalled({kMap, 4});
  EXPECT_EQ(journalled(), 299);
  EXPECT_EQ(take({301, 300}), (std::vector<int32_t>{300}));
  receiver.Journalled({kMap, 300});
  EXPECT_EQ(journalled(), 400);
  EXPECT_EQ(take({401}), (std::vector<int32_t>{401}));
  EXPECT_EQ(receiver.pending(), 1u) << "of those it has, none stays";
}

TEST(Receiver, GivingUpAGapLosesOnlyTheMissingKeyframes) {
  Receiver receiver({}, CheckContent);
  receiver.Resume(kMap, 400, {{kMap, 3, 4}, {kMap, 300, 300}});
  receiver.OnHello({"", {{kMap, 20, 0}}});
  EXPECT_EQ(receiver.given_up(), 2);
  LinkAck ack;
  receiver.FillAck(true, &ack);
  EXPECT_EQ(ack.journalled_seq.at(kMap), 299);
}

TEST(Receiver, EarlierKeyframesMakeRoomInAFullCache) {
  Receiver receiver({100'000}, CheckContent);
  receiver.OnHello({"", {{kMap, 0, 0}}});
  for (int seq = 1; seq < 10; ++seq) {
    AddAll(&receiver, {kMap, seq});
  }
  EXPECT_LE(receiver.cached_bytes(), 100'000);
  EXPECT_TRUE(receiver.TakeReady().empty());
  AddAll(&receiver, {kMap, 0});
  EXPECT_LE(receiver.cached_bytes(), 100'000);
  EXPECT_FALSE(receiver.TakeReady().empty());
}

TEST(Receiver, LaterKeyframesFindNoRoomInAFullCache) {
  constexpr int kCacheBytes = 100'000;
  Receiver receiver({kCacheBytes}, CheckContent);
  receiver.OnHello({"", {{kMap, 0, 0}}});
  size_t room = kCacheBytes, fit = 0;
  for (int seq = 0; seq < 10; ++seq) {
    AddAll(&receiver, {kMap, seq});
    const size_t size = Content({kMap, seq}).size();
    fit += fit == static_cast<size_t>(seq) && size <= room ? 1 : 0;
    room -= std::min(room, size);
  }
  EXPECT_EQ(AddPiece(&receiver, {kMap, 10}, 0), "receive cache full");
  EXPECT_EQ(receiver.TakeReady().size(), fit);
}

// The uplink sends the newest map first, and what it does not send now must not be in the way.
TEST(Receiver, OlderMapsMakeRoomForTheNewestInAFullCache) {
  Receiver receiver({100'000}, CheckContent);
  receiver.OnHello({"", {{kMap, 0, 0}, {kLaterMap, 0, 0, 1}}});
  for (int seq = 1; seq < 10; ++seq) {
    AddAll(&receiver, {kMap, seq});
  }
  EXPECT_EQ(AddPiece(&receiver, {kMap, 12}, 0), "receive cache full");
  for (int seq = 0; seq < 3; ++seq) {
    EXPECT_EQ(AddPiece(&receiver, {kLaterMap, seq}, 0), "") << seq;
  }
  EXPECT_LE(receiver.cached_bytes(), 100'000);
}

// The agent's clock was set back: the map that it is in, the hello's last, has a lower id.
TEST(Receiver, OtherMapsMakeRoomForTheCurrentInAFullCache) {
  Receiver receiver({100'000}, CheckContent);
  receiver.OnHello({"", {{kLaterMap, 0, 0, 1}, {kMap, 0, 0}}});
  for (int seq = 1; seq < 10; ++seq) {
    AddAll(&receiver, {kLaterMap, seq});
  }
  EXPECT_EQ(AddPiece(&receiver, {kLaterMap, 12}, 0), "receive cache full");
  for (int seq = 0; seq < 3; ++seq) {
    EXPECT_EQ(AddPiece(&receiver, {kMap, seq}, 0), "") << seq;
  }
}

TEST(Receiver, KeyframesNotYetOnDiskMakeNoRoomInAFullCache) {
  Receiver receiver({60'000}, CheckContent);
  receiver.OnHello({"", {{kMap, 0, 0}, {kLaterMap, 0, 0}}});
  for (int seq = 0; seq < 10; ++seq) {
    AddAll(&receiver, {kLaterMap, seq});
  }
  const auto ready = receiver.TakeReady();
  ASSERT_FALSE(ready.empty());
  for (int seq = 0; seq < 10; ++seq) {
    AddAll(&receiver, {kMap, seq});
  }
  LinkAck ack;
  receiver.FillAck(true, &ack);
  for (const auto& keyframe : ready) {
    EXPECT_TRUE(ack.partial.contains(keyframe.id)) << keyframe.id.seq;
  }
}

TEST(Receiver, WhatIsAcknowledgedStaysAcknowledged) {
  Receiver receiver({}, CheckContent);
  receiver.Resume(kMap, 10);
  receiver.Journalled({kMap, 3});
  LinkAck ack;
  receiver.FillAck(true, &ack);
  EXPECT_EQ(ack.journalled_seq.at(kMap), 10);
}

// Keyframes handed over but not on disk yet are not given up, even if a hello says so.
TEST(Receiver, AHelloGivesUpNothingThatIsOnItsWayToTheDisk) {
  Receiver receiver({}, CheckContent);
  receiver.OnHello({"", {{kMap, 0, 0}}});
  AddAll(&receiver, {kMap, 0});
  ASSERT_EQ(receiver.TakeReady().size(), 1u);
  receiver.OnHello({"", {{kMap, 5, 0}}});
  EXPECT_EQ(receiver.given_up(), 0);
  receiver.Journalled({kMap, 0});
  receiver.OnHello({"", {{kMap, 5, 0}}});
  EXPECT_EQ(receiver.given_up(), 4);
}

TEST(Receiver, AnAckNamesABoundedNumberOfMaps) {
  Receiver receiver({}, CheckContent);
  for (int i = 1; i < 3 * static_cast<int>(kMaxAckMaps); ++i) {
    receiver.Resume({1, i}, 10);
  }
  LinkAck ack;
  receiver.FillAck(true, &ack);
  EXPECT_EQ(ack.journalled_seq.size(), static_cast<size_t>(kMaxAckMaps));
}

TEST(Receiver, KeyframesThatTheUplinkCannotDeliverAreGivenUpAndCounted) {
  Receiver receiver({}, CheckContent);
  receiver.OnHello({"", {{kMap, 5, 0}}});
  EXPECT_EQ(receiver.given_up(), 5);
  AddAll(&receiver, {kMap, 5});
  const auto ready = receiver.TakeReady();
  ASSERT_EQ(ready.size(), 1u);
  EXPECT_EQ(ready[0].id.seq, 5);
}

TEST(Receiver, AnnouncedMapsThatBringNothingAreForgotten) {
  Receiver receiver({}, CheckContent);
  for (int i = 1; i < 1000; ++i) {
    receiver.OnHello({"", {{{1, i}, 0, 0}}});
    AddPiece(&receiver, {{1, i}, 0}, 0);
  }
  EXPECT_EQ(receiver.num_maps(), 1u);
  EXPECT_EQ(receiver.pending(), 1u);
}

// ... although they say that they had something once.
TEST(Receiver, AnnouncedMapsThatGaveUpAllTheyHadAreForgottenToo) {
  Receiver receiver({}, CheckContent);
  for (int i = 1; i < 1000; ++i) {
    receiver.OnHello({"", {{{1, i}, 5, 0}}});
  }
  EXPECT_EQ(receiver.num_maps(), 1u);
  EXPECT_EQ(receiver.given_up(), 5) << "of the one that is still named";
}

TEST(Receiver, AnAgentHasABoundedNumberOfMaps) {
  Receiver receiver({}, CheckContent);
  const auto most = static_cast<int>(Receiver::kMaxMaps);
  for (int i = 1; i < most; ++i) {
    receiver.Resume({1, i}, 10);
  }
  const MapId last{1, most}, more{1, most + 1};
  EXPECT_EQ(receiver.OnHello({"", {{last, 0, 0}}}), "");
  AddAll(&receiver, {last, 0});
  ASSERT_EQ(receiver.TakeReady().size(), 1u);
  EXPECT_NE(receiver.OnHello({"", {{{1, 1}, 0, 0}, {last, 0, 0, 1}, {more, 0, 0, 2}}}), "");
  EXPECT_EQ(receiver.num_maps(), Receiver::kMaxMaps);
  EXPECT_NE(AddPiece(&receiver, {more, 0}, 0), "");
  EXPECT_EQ(AddPiece(&receiver, {last, 1}, 0), "") << "those that it has go on";
}

}  // namespace
}  // namespace pangea

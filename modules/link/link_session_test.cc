// Tests both ends' sessions over a network that may record, change, repeat and reflect every
// packet.

#include "link/link_session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

namespace pangea {
namespace {

constexpr int32_t kAgent = 4;
using Packet = std::vector<uint8_t>;

class LinkSessionTest : public testing::Test {
 protected:
  Packet Hello() { return uplink->Seal({LinkKind::kHello, ++number, {1, 2}}); }
  Packet Piece(uint8_t content) { return uplink->Seal({LinkKind::kPiece, ++number, {content}}); }

  // The normal handshake: hello, welcome, a hello that names the handler's run.
  void Connect() {
    const auto first = handler->Open(Hello());
    EXPECT_FALSE(first.packet);
    ASSERT_FALSE(first.welcome.empty());
    EXPECT_TRUE(uplink->Open(first.welcome).new_session);
    const auto second = handler->Open(Hello());
    ASSERT_TRUE(second.packet) << second.refused;
    EXPECT_TRUE(second.welcome.empty());
  }
  void RestartUplink() { uplink.emplace(kAgent, key); }
  void RestartHandler() { handler.emplace(kAgent, key); }

  const SecretKey key = SecretKey::Random();
  std::optional<UplinkSession> uplink{std::in_place, kAgent, key};
  std::optional<HandlerSession> handler{std::in_place, kAgent, key};
  int64_t number = 0;
};

TEST_F(LinkSessionTest, CarriesPacketsBothWays) {
  Connect();
  const auto up = handler->Open(Piece(7));
  ASSERT_TRUE(up.packet) << up.refused;
  EXPECT_EQ(up.packet->kind, LinkKind::kPiece);
  EXPECT_EQ(up.packet->number, number);
  EXPECT_EQ(up.packet->body, Packet{7});
  for (int i = 1; i <= 3; ++i) {
    const auto down = uplink->Open(handler->Seal(LinkKind::kAck, {9}));
    ASSERT_TRUE(down.packet) << down.refused;
    EXPECT_EQ(down.packet->number, i);
    EXPECT_FALSE(down.new_session);
  }
}

// A restarted uplink takes over the session. If the earlier one takes it back, two uplinks are
// reported.
TEST_F(LinkSessionTest, TwoUplinksOfOneAgentAreTold) {
  UplinkSession other(kAgent, key);
  const auto connect = [&](UplinkSession& session) {
    const auto first = handler->Open(session.Seal({LinkKind::kHello, ++number, {1}}));
    session.Open(first.welcome);
    return handler->Open(session.Seal({LinkKind::kHello, ++number, {1}}));
  };
  EXPECT_FALSE(connect(*uplink).two_uplinks);
  RestartUplink();
  EXPECT_FALSE(connect(*uplink).two_uplinks);
  EXPECT_FALSE(connect(other).two_uplinks);
  const auto back = connect(*uplink);
  EXPECT_TRUE(back.new_uplink);
  EXPECT_TRUE(back.two_uplinks);
  EXPECT_TRUE(connect(other).two_uplinks);
}

TEST_F(LinkSessionTest, TwentyBytesAPacket) {
  Connect();
  EXPECT_EQ(Piece(7).size(), 1u + kSessionOverheadBytes);
}

TEST_F(LinkSessionTest, NothingIsSentBeforeASession) {
  EXPECT_THROW(Piece(1), std::logic_error);
  EXPECT_THROW(handler->Seal(LinkKind::kAck, {}), std::logic_error);
  EXPECT_NE(handler->Open(Packet(100, 2)).refused, "");
  EXPECT_NE(uplink->Open(Packet(100, 17)).refused, "");
}

TEST_F(LinkSessionTest, ReorderedPacketsPassOnce) {
  Connect();
  std::vector<Packet> packets;
  for (uint8_t i = 0; i < 200; ++i) {
    packets.push_back(Piece(i));
  }
  std::shuffle(packets.begin(), packets.end(), std::mt19937_64(3));
  for (const Packet& packet : packets) {
    EXPECT_TRUE(handler->Open(packet).packet);
  }
  for (const Packet& packet : packets) {
    const auto again = handler->Open(packet);
    EXPECT_FALSE(again.packet);
    EXPECT_NE(again.refused, "");
  }
}

TEST_F(LinkSessionTest, AFlippedBitAnywhereIsRefused) {
  Connect();
  std::vector<Packet> packets = {Hello(), Piece(1)};
  for (const Packet& packet : packets) {
    for (size_t i = 0; i < packet.size(); ++i) {
      for (int bit = 0; bit < 8; ++bit) {
        Packet flipped = packet;
        flipped[i] ^= static_cast<uint8_t>(1 << bit);
        const auto opened = handler->Open(flipped);
        EXPECT_FALSE(opened.packet) << i;
        EXPECT_TRUE(opened.welcome.empty());
        EXPECT_NE(opened.refused, "");
      }
      EXPECT_NE(handler->Open(Bytes(packet).first(i)).refused, "");
    }
    EXPECT_TRUE(handler->Open(packet).packet) << "the true one still passes";
  }
  const Packet ack = handler->Seal(LinkKind::kAck, {1});
  for (size_t i = 0; i < ack.size(); ++i) {
    Packet flipped = ack;
    flipped[i] ^= 0x10;
    EXPECT_FALSE(uplink->Open(flipped).packet) << i;
    EXPECT_FALSE(uplink->Open(Bytes(ack).first(i)).packet);
  }
  EXPECT_TRUE(uplink->Open(ack).packet);
}

// Near the end of the numbers' range a window could not count on.
TEST_F(LinkSessionTest, AHelloWithANumberThatNoUplinkReachesIsRefused) {
  const auto open = [&](int64_t hello) {
    return handler->Open(uplink->Seal({LinkKind::kHello, hello, {1, 2}}));
  };
  constexpr int64_t kFirstTooLarge = int64_t{1} << 48;
  for (const int64_t absurd : {std::numeric_limits<int64_t>::min(), int64_t{0}, kFirstTooLarge,
                               std::numeric_limits<int64_t>::max()}) {
    const auto opened = open(absurd);
    EXPECT_TRUE(opened.welcome.empty()) << absurd;
    EXPECT_NE(opened.refused, "") << absurd;
  }
  for (const int64_t good : {int64_t{1}, kFirstTooLarge - 1}) {
    EXPECT_FALSE(open(good).welcome.empty()) << good;
  }
}

// A packet of a stranger never costs more to check than one of ours.
TEST_F(LinkSessionTest, WhatIsLargerThanAnyPacketIsNotEvenOpened) {
  for (const LinkKind kind : {LinkKind::kHello, LinkKind::kPiece, LinkKind::kWelcome}) {
    std::vector<uint8_t> large(1 << 20);
    large[0] = static_cast<uint8_t>(kind);
    EXPECT_EQ(handler->Open(large).refused, "larger than any packet");
    EXPECT_EQ(uplink->Open(large).refused, "larger than any packet");
  }
}

TEST_F(LinkSessionTest, APacketTurnedBackIsRefused) {
  Connect();
  const Packet up = Piece(1), down = handler->Seal(LinkKind::kAck, {1});
  EXPECT_FALSE(uplink->Open(up).packet);
  EXPECT_FALSE(handler->Open(down).packet);
  EXPECT_FALSE(uplink->Open(Hello()).new_session);
}

TEST_F(LinkSessionTest, AnotherKeyOrAgentGetsNothing) {
  UplinkSession wrong_key(kAgent, SecretKey::Random());
  UplinkSession wrong_agent(kAgent + 1, key);
  for (UplinkSession* stranger : {&wrong_key, &wrong_agent}) {
    const auto opened = handler->Open(stranger->Seal({LinkKind::kHello, 1, {}}));
    EXPECT_NE(opened.refused, "");
    EXPECT_TRUE(opened.welcome.empty());
  }
  HandlerSession other_agent(kAgent + 1, key);
  Connect();
  EXPECT_FALSE(other_agent.Open(Piece(1)).packet);
  EXPECT_NE(other_agent.Open(Hello()).refused, "");
}

// Packets recorded in one session do not open in any later session, whichever side has restarted.
TEST_F(LinkSessionTest, RecordingsAreWorthless) {
  std::vector<Packet> up, down;
  const auto record = [&] {
    up.push_back(Hello());
    const auto first = handler->Open(up.back());
    down.push_back(first.welcome);
    uplink->Open(first.welcome);
    up.push_back(Hello());
    ASSERT_TRUE(handler->Open(up.back()).packet);
    up.push_back(Piece(1));
    ASSERT_TRUE(handler->Open(up.back()).packet);
    down.push_back(handler->Seal(LinkKind::kAck, {1}));
    ASSERT_TRUE(uplink->Open(down.back()).packet);
  };
  int welcomed = 0;
  const auto replay = [&] {
    for (const Packet& packet : up) {
      const auto opened = handler->Open(packet);
      EXPECT_FALSE(opened.packet);
      // A restarted handler's answer to the newest hello is valid, even if the hello was replayed.
      welcomed += uplink->Open(opened.welcome).new_session ? 1 : 0;
    }
    for (const Packet& packet : down) {
      const auto opened = uplink->Open(packet);
      EXPECT_FALSE(opened.packet);
      EXPECT_FALSE(opened.new_session);
    }
  };
  record();
  replay();
  EXPECT_EQ(welcomed, 0);
  RestartHandler();
  replay();
  EXPECT_EQ(welcomed, 1);
  ASSERT_TRUE(handler->Open(Hello()).packet);
  replay();
  EXPECT_EQ(welcomed, 1);
  EXPECT_TRUE(handler->Open(Piece(2)).packet) << "the session goes on under the replay";
  RestartUplink();
  replay();
  record();
  replay();
  EXPECT_EQ(welcomed, 1);
}

TEST_F(LinkSessionTest, ARestartedHandlerIsFoundByTheNextHello) {
  Connect();
  RestartHandler();
  EXPECT_FALSE(handler->Open(Piece(1)).packet);
  const auto opened = handler->Open(Hello());
  EXPECT_TRUE(uplink->Open(opened.welcome).new_session);
  const auto hello = handler->Open(Hello());
  EXPECT_TRUE(hello.packet);
  EXPECT_TRUE(hello.new_uplink);
  EXPECT_TRUE(handler->Open(Piece(1)).packet);
}

TEST_F(LinkSessionTest, ARestartedUplinkTakesTheSessionOver) {
  Connect();
  const Packet late = Piece(1);
  RestartUplink();
  number = 0;
  const auto opened = handler->Open(Hello());
  EXPECT_TRUE(handler->Open(late).packet) << "the old one lives until the new one is proven";
  EXPECT_TRUE(uplink->Open(opened.welcome).new_session);
  const auto hello = handler->Open(Hello());
  ASSERT_TRUE(hello.packet);
  EXPECT_TRUE(hello.new_uplink);
  EXPECT_TRUE(handler->Open(Piece(1)).packet);
}

// A run names one session: a recorded hello cannot end the one that came after it.
TEST_F(LinkSessionTest, ARunIsOfferedUntilItIsUsedAndNeverAgain) {
  Connect();
  const Packet recorded = Hello();  // names the handler's run, and never arrived
  RestartUplink();
  number = 0;
  Connect();
  const auto replayed = handler->Open(recorded);
  EXPECT_FALSE(replayed.packet);
  EXPECT_FALSE(replayed.new_uplink);
  EXPECT_TRUE(handler->Open(Piece(1)).packet);
}

// With a long round trip many hellos are sent before the first answer: they make only one session.
TEST_F(LinkSessionTest, ManyHellosUnderWayMakeOneSession) {
  std::vector<Packet> hellos;
  for (int i = 0; i < 16; ++i) {
    hellos.push_back(Hello());
  }
  std::vector<Packet> welcomes;
  for (const Packet& hello : hellos) {
    welcomes.push_back(handler->Open(hello).welcome);
  }
  int sessions = 0;
  for (const Packet& welcome : welcomes) {
    sessions += uplink->Open(welcome).new_session ? 1 : 0;
  }
  EXPECT_EQ(sessions, 1);
  EXPECT_TRUE(handler->Open(Hello()).packet);
  // One of the early ones comes last, and is answered with another run.
  const auto late = handler->Open(hellos[8]);
  EXPECT_FALSE(uplink->Open(late.welcome).new_session);
  EXPECT_TRUE(handler->Open(Piece(1)).packet);
}

}  // namespace
}  // namespace pangea

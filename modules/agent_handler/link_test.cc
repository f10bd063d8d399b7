// Sender and receiver against each other over a channel that loses, doubles, delays and reorders by
// a seeded script.

#include <gtest/gtest.h>
#include <malloc.h>

#include <queue>
#include <random>

#include "agent_handler/receiver.h"
#include "link/test_content.h"
#include "uplink/sender.h"

namespace pangea {
namespace {

struct Channel {
  double loss = 0;
  double doubled = 0;
  int64_t delay_us = 0;
  int64_t jitter_us = 0;
};

template <typename T>
class Pipe {
 public:
  Pipe(const Channel& channel, uint64_t seed) : channel_(channel), rng_(seed) {}
  void Push(int64_t now, const T& item) {
    const int copies = 1 + (Unit() < channel_.doubled ? 1 : 0);
    for (int i = 0; i < copies; ++i) {
      if (Unit() >= channel_.loss) {
        const auto jitter = static_cast<int64_t>(Unit() * static_cast<double>(channel_.jitter_us));
        waiting_.emplace(now + channel_.delay_us + jitter, item);
      }
    }
  }
  std::vector<T> Pop(int64_t now) {
    std::vector<T> out;
    while (!waiting_.empty() && waiting_.begin()->first <= now) {
      out.push_back(waiting_.begin()->second);
      waiting_.erase(waiting_.begin());
    }
    return out;
  }

 private:
  double Unit() { return std::uniform_real_distribution<double>(0, 1)(rng_); }
  Channel channel_;
  std::mt19937_64 rng_;
  std::multimap<int64_t, T> waiting_;
};

// One agent, one server, an hour of simulated milliseconds at most.
class World {
 public:
  World(const Channel& channel, uint64_t seed, const SenderOptions& options = {})
      : sender(options),
        receiver(std::make_unique<Receiver>(ReceiverOptions{}, CheckContent)),
        up_(channel, seed),
        down_(channel, seed + 1) {}

  void Spool(const MapId& map, int count) {
    for (int seq = 0; seq < count; ++seq) {
      ASSERT_TRUE(sender.Add({map, seq}, Content({map, seq})));
    }
    sender.SetNext(map, 0);
  }

  void Hello(const std::vector<MapId>& maps) {
    LinkHello hello;
    for (const MapId& map : maps) {
      hello.maps.push_back({map, 0, 0});
    }
    receiver->OnHello(hello);
    SendAck();
  }

  // As the uplink does before anything else; until its answer is there.
  void SendHello() {
    up_.Push(now, {sender.NextNumber(now), {}, {}});
    while (now < 5'000'000) {
      Step();
    }
  }

  void SendAck() {
    LinkAck ack;
    ack.highest_number = highest_number_;
    receiver->FillAck(true, &ack);
    const auto parsed = ParseAck(1, {LinkKind::kAck, ++acks_, Encode(ack)});
    ASSERT_TRUE(parsed.value) << parsed.refused;
    EXPECT_LE(Encode(ack).size(), size_t{kFramePayloadBytes});
    down_.Push(now, *parsed.value);
  }

  void Step() {
    now += 5'000;
    for (const Sender::Sent& sent : sender.Poll(now)) {
      const std::vector<uint8_t> body = Encode(sent.piece);
      largest_body = std::max(largest_body, body.size());
      ++packets_sent;
      up_.Push(now, {sent.number,
                     sent.keyframe.map,
                     {sent.piece.last ? LinkKind::kLastPiece : LinkKind::kPiece, 0, body}});
    }
    most_in_flight = std::max(most_in_flight, sender.in_flight_bytes());
    for (const UpPacket& packet : up_.Pop(now)) {
      highest_number_ = std::max(highest_number_, packet.number);
      if (packet.piece.body.empty()) {
        continue;  // a hello
      }
      const auto piece = ParsePiece(packet.piece);
      ASSERT_TRUE(piece.value) << piece.refused;
      refusals += receiver->Add(packet.map, *piece.value).empty() ? 0 : 1;
      most_cached = std::max(most_cached, receiver->cached_bytes());
    }
    for (const auto& keyframe : receiver->TakeReady()) {
      taken.push_back(keyframe.id);
      receiver->Journalled(keyframe.id);
    }
    if (now % 20'000 == 0) {
      SendAck();
    }
    for (const LinkAck& ack : down_.Pop(now)) {
      if (ack.number <= newest_ack_) {
        continue;
      }
      newest_ack_ = ack.number;
      sender.OnAck(ack, now);
      for (const auto& [map, seq] : ack.journalled_seq) {
        sender.SetNext(map, seq + 1);
      }
    }
  }

  void RunUntilDelivered(int64_t limit_s) {
    while (sender.spooled() > 0 && now < limit_s * 1'000'000) {
      Step();
    }
  }

  Sender sender;
  std::unique_ptr<Receiver> receiver;
  int64_t now = 0;
  std::vector<KeyframeId> taken;
  int most_in_flight = 0;
  int64_t most_cached = 0;
  size_t largest_body = 0;
  int64_t packets_sent = 0;
  int refusals = 0;

 private:
  struct UpPacket {
    int64_t number = 0;
    MapId map;
    LinkPacket piece;
  };
  Pipe<UpPacket> up_;
  Pipe<LinkAck> down_;
  int64_t acks_ = 0;
  int64_t newest_ack_ = 0;
  int64_t highest_number_ = 0;
};

std::vector<KeyframeId> InOrderIds(const MapId& map, int count) {
  std::vector<KeyframeId> ids;
  ids.reserve(static_cast<size_t>(count));
  for (int seq = 0; seq < count; ++seq) {
    ids.push_back({map, seq});
  }
  return ids;
}

class LossyLink : public testing::TestWithParam<std::tuple<Channel, uint64_t>> {};

TEST_P(LossyLink, EverythingArrivesOnceInOrderInBoundedMemory) {
  const auto& [channel, seed] = GetParam();
  World world(channel, seed);
  world.Hello({kMap});
  world.Spool(kMap, 60);
  world.RunUntilDelivered(600);
  EXPECT_EQ(world.taken, InOrderIds(kMap, 60));
  EXPECT_EQ(world.sender.spooled(), 0u);
  EXPECT_EQ(world.sender.spooled_bytes(), 0);
  EXPECT_EQ(world.sender.in_flight_bytes(), 0);
  EXPECT_EQ(world.receiver->pending(), 0u);
  EXPECT_EQ(world.receiver->cached_bytes(), 0);
  EXPECT_LE(world.most_cached, ReceiverOptions{}.cache_bytes);
  EXPECT_LE(world.most_in_flight, SenderOptions{}.max_in_flight_bytes);
  EXPECT_LE(world.largest_body, size_t{kPieceHeaderBytes + kFramePayloadBytes});
}

INSTANTIATE_TEST_SUITE_P(Channels, LossyLink,
                         testing::Combine(testing::Values(Channel{}, Channel{0, 0, 50'000, 0},
                                                          Channel{0.05, 0.05, 20'000, 10'000},
                                                          Channel{0.1, 0, 5'000, 100'000},
                                                          Channel{0.3, 0.2, 30'000, 60'000},
                                                          Channel{0.1, 0, 2'000'000, 0}),
                                          testing::Values(1, 2, 3)));

// Without loss nothing is sent twice.
TEST(Link, CleanChannelSendsNothingTwice) {
  World world({0, 0, 10'000, 0}, 1);
  world.Hello({kMap});
  world.Spool(kMap, 60);
  const int64_t spooled = world.sender.spooled_bytes();
  world.RunUntilDelivered(60);
  EXPECT_EQ(world.sender.resent(), 0);
  EXPECT_EQ(world.refusals, 0);
  EXPECT_LE(world.packets_sent * kFramePayloadBytes, spooled + int64_t{60} * kFramePayloadBytes);
}

// At 10 % loss (of acknowledgements too) the traffic stays below 1.3 times the keyframes.
TEST(Link, RepeatsStayModestUnderLoss) {
  World world({0.1, 0, 20'000, 5'000}, 4);
  world.Hello({kMap});
  world.Spool(kMap, 200);
  const int64_t spooled = world.sender.spooled_bytes();
  world.RunUntilDelivered(600);
  EXPECT_EQ(world.sender.spooled(), 0u);
  EXPECT_LT(static_cast<double>(world.packets_sent * kFramePayloadBytes),
            1.3 * static_cast<double>(spooled));
}

// Delivers 200 keyframes; returns their bytes per second.
double DeliveredPerSecond(World* world) {
  world->Hello({kMap});
  world->SendHello();
  const int64_t begin = world->now;
  world->Spool(kMap, 200);
  const auto spooled = static_cast<double>(world->sender.spooled_bytes());
  world->RunUntilDelivered(600);
  EXPECT_EQ(world->sender.spooled(), 0u);
  return spooled / (1e-6 * static_cast<double>(world->now - begin));
}

// A round trip of 4 s holds back no agent that makes 40 kB/s of keyframes, and nothing that is only
// late is sent twice.
TEST(Link, ALongDelayLeavesTheRateOfAnAgent) {
  World world({0, 0, 2'000'000, 0}, 4);
  EXPECT_GT(DeliveredPerSecond(&world), 40e3);
  EXPECT_EQ(world.sender.resent(), 0);
}

// Nor does one that loses every fifth packet too: a keyframe then needs two to three round trips,
// so more of them must be under way.
TEST(Link, ALongDelayWithLossLeavesTheRateOfAnAgent) {
  World world({0.2, 0, 2'000'000, 0}, 4);
  EXPECT_GT(DeliveredPerSecond(&world), 40e3);
  EXPECT_LT(world.sender.resent(), world.packets_sent / 2);
}

TEST(Link, TwoMapsAreDeliveredEachInOrder) {
  World world({0.1, 0.1, 10'000, 30'000}, 5);
  world.Hello({kMap, kLaterMap});
  world.Spool(kMap, 20);
  world.Spool(kLaterMap, 20);
  world.RunUntilDelivered(600);
  auto expected = InOrderIds(kMap, 20);
  const auto later = InOrderIds(kLaterMap, 20);
  std::vector<KeyframeId> got_first, got_later;
  for (const KeyframeId& id : world.taken) {
    (id.map == kMap ? got_first : got_later).push_back(id);
  }
  EXPECT_EQ(got_first, expected);
  EXPECT_EQ(got_later, later);
}

TEST(Link, AnyPacketSizeDeliversEverything) {
  for (const int payload : {256, 4096, 30'000}) {
    SenderOptions options;
    options.payload_bytes = payload;
    ASSERT_FALSE(options.Invalid());
    World world({0.1, 0, 10'000, 10'000}, 6, options);
    world.Hello({kMap});
    world.Spool(kMap, 20);
    world.RunUntilDelivered(600);
    EXPECT_EQ(world.taken, InOrderIds(kMap, 20)) << payload;
  }
}

// The receiver forgets everything but its journal.
TEST(Link, RestartedReceiverGoesOnFromItsJournal) {
  World world({0.1, 0, 10'000, 10'000}, 7);
  world.Hello({kMap});
  world.Spool(kMap, 40);
  while (world.taken.size() < 15) {
    world.Step();
  }
  const int32_t journalled = world.taken.back().seq;
  world.receiver = std::make_unique<Receiver>(ReceiverOptions{}, CheckContent);
  world.receiver->Resume(kMap, journalled);
  world.Hello({kMap});
  world.RunUntilDelivered(600);
  EXPECT_EQ(world.taken, InOrderIds(kMap, 40));
}

TEST(Sender, FullSpoolRefusesTheNewest) {
  SenderOptions options;
  options.max_spool_bytes = 100'000;
  Sender sender(options);
  EXPECT_TRUE(sender.Add({kMap, 0}, std::vector<uint8_t>(60'000)));
  EXPECT_FALSE(sender.Add({kMap, 1}, std::vector<uint8_t>(60'000)));
  EXPECT_TRUE(sender.Has({kMap, 0}));
  sender.SetNext(kMap, 1);
  EXPECT_TRUE(sender.Add({kMap, 1}, std::vector<uint8_t>(60'000)));
}

LinkAck AckOf(int64_t highest_number) {
  LinkAck ack;
  ack.highest_number = highest_number;
  ack.cache_bytes = 1 << 20;
  return ack;
}

TEST(Sender, KeepsToItsWindow) {
  SenderOptions options;
  options.max_in_flight_bytes = 10'000;
  World world({0.05, 0, 100'000, 0}, 8, options);
  world.Hello({kMap});
  world.Spool(kMap, 5);
  world.RunUntilDelivered(600);
  EXPECT_EQ(world.taken, InOrderIds(kMap, 5));
  EXPECT_LE(world.most_in_flight, 10'000);
}

TEST(Sender, HasFewKeyframesUnderWay) {
  Sender sender({});
  for (int seq = 0; seq < 100; ++seq) {
    ASSERT_TRUE(sender.Add({kMap, seq}, std::vector<uint8_t>(100)));
  }
  sender.SetNext(kMap, 0);
  sender.OnAck(AckOf(0), 1);
  EXPECT_EQ(sender.Poll(2).size(), static_cast<size_t>(kMaxPartialKeyframes));
}

TEST(Sender, UnansweredKeyframesAreSentEverMoreRarely) {
  Sender sender({});
  ASSERT_TRUE(sender.Add({kMap, 0}, std::vector<uint8_t>(100)));
  sender.SetNext(kMap, 0);
  size_t sent = 0;
  for (int64_t ms = 0; ms < 60'000; ms += 10) {
    sent += sender.Poll(1000 * ms).size();
  }
  EXPECT_GT(sent, 5u);
  EXPECT_LE(sent, 12u);  // after 1, 2, 4, 8, 10, 10, ... s
}

// A packet that others have overtaken is not waited for, nor is it sent without end.
TEST(Sender, AnOvertakenPieceIsRetransmittedAtOnceButNotForEver) {
  SenderOptions options;
  options.payload_bytes = kMinPayloadBytes;
  Sender sender(options);
  const KeyframeId id{kMap, 0};
  ASSERT_TRUE(sender.Add(id, std::vector<uint8_t>(60 * kMinPayloadBytes)));
  sender.SetNext(kMap, 0);
  sender.OnAck(AckOf(0), 1);
  const auto first = sender.Poll(1'000);
  ASSERT_EQ(first.size(), 60u);
  int64_t now = 10'000;
  LinkAck ack = AckOf(first.back().number);
  ack.partial[id] = std::vector<uint8_t>(8, 0xFF);
  ack.partial[id][0] = 0xFE;  // all but the first piece
  sender.OnAck(ack, now);
  const auto again = sender.Poll(now);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].piece.index, 0);
  // It arrives nowhere, while other packets do.
  size_t sent = 0;
  for (; now < 2'000'000; now += 10'000) {
    for (int i = 0; i < 30; ++i) {
      ack.highest_number = sender.NextNumber(now);
    }
    sender.OnAck(ack, now);
    sent += sender.Poll(now).size();
  }
  EXPECT_GE(sent, 4u);
  EXPECT_LE(sent, 10u);
}

TEST(Sender, KeyframesStoredInTheSpoolTakeNoMemory) {
  constexpr int kKeyframes = 2000;
  constexpr size_t kBytes = 24'000;
  const auto in_use = [] { return mallinfo2().uordblks; };
  const size_t before = in_use();
  Sender sender({});
  for (int seq = 0; seq < kKeyframes; ++seq) {
    ASSERT_TRUE(sender.Add({kMap, seq}, std::vector<uint8_t>(kBytes)));
    sender.SetStored({kMap, seq});
  }
  EXPECT_LE(sender.spooled_bytes(), Sender::kMaxStoredInMemory + int64_t{kBytes});
  EXPECT_LE(in_use() - before, size_t{Sender::kMaxStoredInMemory} + kBytes + 500 * kKeyframes);
}

TEST(Sender, PacesToItsBandwidth) {
  SenderOptions options;
  options.bandwidth_kb_per_s = 100;
  World world({}, 1, options);
  world.Hello({kMap});
  world.Spool(kMap, 60);
  const int64_t bytes = world.sender.spooled_bytes();
  world.RunUntilDelivered(600);
  EXPECT_GE(static_cast<double>(world.now) * 1e-6, static_cast<double>(bytes) / 100'000 - 0.5);
  EXPECT_LE(static_cast<double>(world.now) * 1e-6, static_cast<double>(bytes) / 100'000 * 1.2);
}

}  // namespace
}  // namespace pangea

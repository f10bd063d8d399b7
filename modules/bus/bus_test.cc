#include "bus/bus.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <limits>
#include <thread>

#include "bus/node.h"
#include "bus/retransmission/missing.h"
#include "bus/retransmission/reorder_buffer.h"
#include "bus/retransmission/timeouts.h"
#include "pangea/again_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/resend_request_t.hpp"

namespace pangea {
namespace {

have_t MakeHave(int32_t seq) {
  have_t have{};
  have.num_maps = 1;
  have.maps.resize(1);
  have.maps[0].agent_id = 1;
  have.highest_seq = {seq};
  return have;
}

TEST(LocalBus, DeliversInOrderIncludingWhatHandlersPublish) {
  LocalBus bus;
  std::vector<std::string> seen;
  bus.Subscribe("A", [&](const std::string& channel, Bytes) {
    seen.push_back(channel);
    bus.Publish("B", {});
  });
  bus.Subscribe("[AB]",
                [&](const std::string& channel, Bytes) { seen.push_back("any " + channel); });
  bus.Publish("A", {});
  bus.Publish("AB", {});  // anchored: matches neither
  bus.Drain();
  EXPECT_THAT(seen, testing::ElementsAre("A", "any A", "any B"));
}

TEST(LcmBus, KnowsWhetherMoreWaits) {
  LcmBus bus("memq://");
  std::vector<bool> more;
  bus.Subscribe("A", [&](const std::string&, Bytes) { more.push_back(bus.MoreWaits()); });
  bus.Subscribe("B", [](const std::string&, Bytes) {});
  bus.Publish("A", {});
  bus.Publish("B", {});
  bus.Publish("A", {});
  while (bus.Handle(0)) {
  }
  EXPECT_THAT(more, testing::ElementsAre(true, false));
}

TEST(LocalBus, DoesAllWorkAtOnce) {
  LocalBus bus;
  int left = 3;
  bus.WorkWhenIdle([&] { return --left > 0; });
  EXPECT_EQ(left, 0);
}

// The messages that one piece of work publishes are handled before the next piece.
TEST(LcmBus, WorksWhileNoMessageWaits) {
  LcmBus bus("memq://");
  std::string done;
  int pieces = 3;
  bus.Subscribe("WORK", [&](const std::string&, Bytes) {
    done += 'w';
    bus.WorkWhenIdle([&] {
      done += 'p';
      bus.Publish("OTHER", {});
      return --pieces > 0;
    });
  });
  bus.Subscribe("OTHER", [&](const std::string&, Bytes) { done += 'o'; });
  bus.Publish("WORK", {});
  bus.Publish("OTHER", {});
  while (bus.Handle(0)) {
  }
  EXPECT_EQ(done, "wopopopo");
}

TEST(LcmBus, WorkThatGivesOtherWorkAtItsEndIsFollowedByIt) {
  LcmBus bus("memq://");
  std::string done;
  bus.WorkWhenIdle([&] {
    done += "a";
    bus.WorkWhenIdle([&] {
      done += "b";
      return done != "abb";
    });
    return false;
  });
  while (bus.Handle(0)) {
  }
  EXPECT_EQ(done, "abb");
}

TEST(LcmBus, AFloodDoesNotKeepItFromItsWork) {
  LcmBus bus("memq://");
  bool worked = false;
  bus.Subscribe("FLOOD", [&](const std::string&, Bytes) { bus.Publish("FLOOD", {}); });
  bus.Publish("FLOOD", {});
  bus.WorkWhenIdle([&] {
    worked = true;
    return false;
  });
  for (int i = 0; i < 1000; ++i) {
    bus.Handle(0);
  }
  EXPECT_TRUE(worked);
}

TEST(Node, CountsWhatDoesNotDecode) {
  LocalBus bus;
  Node node(bus, "test");
  int32_t got = -1;
  node.Subscribe<have_t>("HAVE",
                         [&](const std::string&, const have_t& m) { got = m.highest_seq[0]; });
  PublishMessage(bus, "HAVE", MakeHave(5));
  bus.Publish("HAVE", std::vector<uint8_t>{1, 2, 3});
  bus.Drain();
  EXPECT_EQ(got, 5);
  const status_t status = node.Status(0, 0, "");
  ASSERT_EQ(status.num_refused, 1);
  EXPECT_EQ(status.refused[0].count, 1);
  EXPECT_EQ(status.messages_in, 2);
}

TEST(Node, TellsAtMostFiftyReasonsApart) {
  LocalBus bus;
  Node node(bus, "test");
  for (int i = 0; i < 200; ++i) {
    node.Refuse("reason " + std::to_string(i));
  }
  const status_t status = node.Status(0, 0, "");
  int64_t refused = 0;
  for (const counter_t& counter : status.refused) {
    refused += counter.count;
  }
  EXPECT_EQ(refused, 200);
  EXPECT_EQ(status.num_refused, 51);  // and "other reasons"
}

TEST(Node, TellsOfTheNewestThousandMessages) {
  LocalBus bus;
  Node node(bus, "test");
  node.SubscribeBytes("SLOW", [](const std::string&, Bytes) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  });
  node.SubscribeBytes("QUICK", [](const std::string&, Bytes) {});
  const auto publish = [&](const std::string& channel, int times) {
    for (int i = 0; i < times; ++i) {
      bus.Publish(channel, {});
    }
    bus.Drain();
  };
  publish("SLOW", 30);
  publish("QUICK", 970);
  EXPECT_GE(node.Status(0, 0, "").handling_p99_ms, 5.0F);
  publish("QUICK", 30);
  EXPECT_LT(node.Status(0, 0, "").handling_p99_ms, 5.0F);
}

// Every truncated message and every corrupted byte must give a result, not a crash.
TEST(DecodeMessage, SurvivesDamage) {
  const have_t have = MakeHave(7);
  std::vector<uint8_t> bytes = EncodeMessage(have);
  have_t out{};
  for (size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(DecodeMessage(Bytes(bytes).first(length), &out));
  }
  for (size_t i = 0; i < bytes.size(); ++i) {
    std::vector<uint8_t> damaged = bytes;
    damaged[i] ^= 0xFF;
    DecodeMessage(damaged, &out);
  }
  EXPECT_TRUE(DecodeMessage(bytes, &out));
}

void PutInt32(int32_t value, size_t at, std::vector<uint8_t>* bytes) {
  for (size_t i = 0; i < 4; ++i) {
    (*bytes)[at + i] = static_cast<uint8_t>(static_cast<uint32_t>(value) >> (24 - 8 * i));
  }
}

int64_t PeakMemory_kB() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

// lcm-gen's decoders use a count before they compare it with the rest of the payload
// (lcmtypes/harden.sed).
TEST(DecodeMessage, HugeAndNegativeCountsNeitherAllocateNorReadBeyondTheEnd) {
  again_t again{};
  again.channel = "AB";
  std::vector<uint8_t> bytes = EncodeMessage(again);
  const int64_t before = PeakMemory_kB();
  constexpr size_t kStringLength = 8, kCount = 8 + 4 + 3;
  for (const int32_t value : {std::numeric_limits<int32_t>::min(), -2, -1, 1 << 30,
                              std::numeric_limits<int32_t>::max()}) {
    for (const size_t at : {kStringLength, kCount}) {
      std::vector<uint8_t> hostile = bytes;
      PutInt32(value, at, &hostile);
      EXPECT_FALSE(DecodeMessage(hostile, &again)) << value << " at " << at;
      EXPECT_LT(again.channel.size() + again.data.capacity(), 100u);
    }
  }
  std::vector<uint8_t> hostile = bytes;
  PutInt32(0, kStringLength, &hostile);
  EXPECT_FALSE(DecodeMessage(hostile, &again)) << "a string has at least its end";
  EXPECT_LT(PeakMemory_kB() - before, 100'000);
}

TEST(ReorderBuffer, ReordersDropsRepeatsAndNamesGaps) {
  const MapId map{1, 10};
  ReorderBuffer<int> stream;
  EXPECT_THAT(stream.Add(map, 1, 101), testing::IsEmpty());
  EXPECT_THAT(stream.Add(map, 3, 103), testing::IsEmpty());
  ASSERT_EQ(stream.Gaps().size(), 1u);
  EXPECT_EQ(stream.Gaps()[0].from_seq, 0);
  EXPECT_EQ(stream.Gaps()[0].to_seq, 0);
  EXPECT_THAT(stream.Add(map, 0, 100), testing::ElementsAre(100, 101));
  EXPECT_THAT(stream.Add(map, 0, 100), testing::IsEmpty());
  EXPECT_THAT(stream.Add(map, 2, 102), testing::ElementsAre(102, 103));
  EXPECT_TRUE(stream.Gaps().empty());
  stream.Announce(map, 9);
  ASSERT_EQ(stream.Gaps().size(), 1u);
  EXPECT_EQ(stream.Gaps()[0].from_seq, 4);
  EXPECT_EQ(stream.Gaps()[0].to_seq, 9);
}

TEST(MissingMessages, AreAskedForUntilTheyComeOrNobodyHasThem) {
  constexpr int64_t kWait = timeouts::kGapWait_us, kInterval = timeouts::kRequestInterval_us;
  const MapId map{1, 100};
  MissingMessages missing;
  missing.Note(map, 0);
  missing.Announce(Have{{{map, 99}}, {}});
  EXPECT_TRUE(missing.Due(0).empty());  // it may be under way
  EXPECT_TRUE(missing.Due(kWait - 1).empty());
  const auto due = missing.Due(kWait);
  ASSERT_EQ(due.size(), 1u);
  EXPECT_EQ(due[0].from_seq, 1);
  EXPECT_EQ(due[0].to_seq, 50);  // not all at once
  EXPECT_TRUE(missing.Due(kWait + kInterval - 1).empty());
  EXPECT_EQ(missing.Due(kWait + kInterval).size(), 1u);
  missing.Announce(Have{{}, {{map, 1, 98}}});
  missing.Note(map, 99);
  missing.Due(4 * kInterval);
  EXPECT_TRUE(missing.Due(9 * kInterval).empty());
}

TEST(MissingMessages, TheLastOneIsMissedAndNoneBeyondIt) {
  const MapId map{1, 100};
  MissingMessages missing;
  missing.Note(map, 0);
  missing.Announce(Have{{{map, 1}}, {}});
  EXPECT_TRUE(missing.Lacks(map, 1));
  missing.Due(0);
  const auto due = missing.Due(timeouts::kGapWait_us);
  ASSERT_EQ(due.size(), 1u);
  EXPECT_EQ(due[0].from_seq, 1);
  EXPECT_EQ(due[0].to_seq, 1);
  missing.Note(map, 1);
  EXPECT_FALSE(missing.Lacks(map, 1));
  EXPECT_TRUE(missing.Due(9'000'000).empty());
}

TEST(MissingMessages, TheNextPartIsAskedForOnceTheLastHasCome) {
  const MapId map{1, 100};
  MissingMessages missing;
  missing.Announce(Have{{{map, 99}}, {}});
  missing.Due(0);
  ASSERT_EQ(missing.Due(timeouts::kGapWait_us).size(), 1u);
  int64_t now = timeouts::kGapWait_us;
  for (int32_t seq = 0; seq < 49; ++seq) {  // answers come, slowly: none is asked for twice
    missing.Note(map, seq);
    EXPECT_TRUE(missing.Due(now += timeouts::kRequestInterval_us / 2).empty());
  }
  missing.Note(map, 49);
  const auto due = missing.Due(now);
  ASSERT_EQ(due.size(), 1u);
  EXPECT_EQ(due[0].from_seq, 50);
  EXPECT_EQ(due[0].to_seq, 99);
}

TEST(RequestAllRetransmissions, AsksForEachOnce) {
  LocalBus bus;
  Node node(bus, "test");
  std::vector<std::pair<int32_t, int32_t>> ranges;
  bus.Subscribe("RESEND_REQUEST", [&](const std::string&, Bytes data) {
    resend_request_t request{};
    ASSERT_TRUE(DecodeMessage(data, &request));
    ranges.emplace_back(request.from_seq, request.to_seq);
  });
  RequestAllRetransmissions(node, "CONSTRAINT", {1, 100}, 1000);
  bus.Drain();
  EXPECT_THAT(ranges, testing::ElementsAre(testing::Pair(0, 499), testing::Pair(500, 999),
                                           testing::Pair(1000, 1000)));
}

TEST(ReorderBuffer, GoesOnAfterAGapNobodyCanFill) {
  const MapId map{1, 10};
  ReorderBuffer<int> stream;
  stream.Add(map, 0, 100);
  stream.Add(map, 4, 104);
  EXPECT_THAT(stream.Skip({map, 2, 3}), testing::IsEmpty()) << "1 may still come";
  EXPECT_THAT(stream.Skip({map, 1, 3}), testing::ElementsAre(104));
  EXPECT_EQ(stream.next(map), 5);
  EXPECT_TRUE(stream.Gaps().empty());
}

TEST(ReorderBuffer, AGapOfOneIsPassed) {
  const MapId map{1, 10};
  ReorderBuffer<int> stream;
  stream.Add(map, 1, 101);
  EXPECT_THAT(stream.Skip({map, 0, 0}), testing::ElementsAre(101));
}

TEST(ReorderBuffer, WhatAGapPassesIsDropped) {
  const MapId map{1, 10};
  ReorderBuffer<int> stream;
  stream.Add(map, 2, 102);
  stream.Add(map, 5, 105);
  EXPECT_THAT(stream.Skip({map, 0, 4}), testing::ElementsAre(105));
  EXPECT_EQ(stream.num_buffered(), 0u);
}

TEST(ReorderBuffer, BuffersAThousandAndTakesTheNextOneAlways) {
  const MapId map{1, 10};
  ReorderBuffer<int> stream;
  const auto capacity = static_cast<int32_t>(ReorderBuffer<int>::kMaxBuffered);
  for (int32_t seq = 1; seq <= capacity + 500; ++seq) {
    EXPECT_THAT(stream.Add(map, seq, seq), testing::IsEmpty());
  }
  EXPECT_EQ(stream.num_buffered(), ReorderBuffer<int>::kMaxBuffered);
  EXPECT_EQ(stream.Add(map, 0, 0).size(), ReorderBuffer<int>::kMaxBuffered + 1);
  ASSERT_EQ(stream.Gaps().size(), 1u);
  EXPECT_EQ(stream.Gaps()[0].from_seq, capacity + 1);  // dropped, and known to exist
  EXPECT_EQ(stream.Gaps()[0].to_seq, capacity + 500);
}

TEST(MissingStates, AreAskedForUntilTheyAreSaidButNotForEver) {
  MissingStates missing;
  missing.Announce({1, 1});
  missing.Announce({2, 1});
  EXPECT_EQ(missing.Due(0).size(), 2u);
  EXPECT_TRUE(missing.Due(1'000'000).empty());
  missing.Note({{2, 1}});
  int asked = 0;
  for (int64_t second = 2; second < 60; ++second) {
    asked += static_cast<int>(missing.Due(second * 1'000'000).size());
  }
  EXPECT_TRUE(missing.empty());
  EXPECT_EQ(asked, 14);
}

}  // namespace
}  // namespace pangea

#include "link_emulator/link_emulator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "link_emulator/link_emulator_process.h"
#include "messages/channels.h"
#include "messages/encoding.h"

namespace pangea {
namespace {

constexpr int64_t kMilli = 1000;
constexpr int64_t kSecond = 1'000'000;
constexpr int kMany = 20'000;

std::vector<uint8_t> Numbered(int number) {
  return {static_cast<uint8_t>(number), static_cast<uint8_t>(number >> 8),
          static_cast<uint8_t>(number >> 16)};
}

int NumberOf(const std::vector<uint8_t>& packet) {
  return packet[0] | (packet[1] << 8) | (packet[2] << 16);
}

struct Arrival {
  int number = 0;
  int64_t at_us = 0;
};

// `count` packets, one each `spacing_us`; what arrives, in order.
std::vector<Arrival> Send(LinkEmulator* emulator, int count, int64_t spacing_us) {
  std::vector<Arrival> arrivals;
  const auto take = [&](int64_t now) {
    for (const LinkEmulator::Delivery& delivery : emulator->TakeDue(now)) {
      arrivals.push_back({NumberOf(delivery.packet), delivery.at_us});
    }
  };
  for (int i = 0; i < count; ++i) {
    take(spacing_us * i);
    emulator->Add(spacing_us * i, Numbered(i));
  }
  while (emulator->next_due_us()) {
    take(*emulator->next_due_us());
  }
  return arrivals;
}

std::vector<Arrival> SendOver(const LinkConditions& conditions, int64_t spacing_us = kMilli,
                              LinkDirection direction = LinkDirection::kUp) {
  LinkEmulator emulator(conditions, direction);
  return Send(&emulator, kMany, spacing_us);
}

std::vector<int> NumbersOf(const std::vector<Arrival>& arrivals) {
  std::vector<int> numbers;
  for (const Arrival& arrival : arrivals) {
    numbers.push_back(arrival.number);
  }
  return numbers;
}

TEST(LinkEmulator, APerfectLinkChangesNothing) {
  const auto arrivals = SendOver({});
  ASSERT_EQ(arrivals.size(), size_t{kMany});
  for (int i = 0; i < kMany; ++i) {
    EXPECT_EQ(arrivals[static_cast<size_t>(i)].number, i);
    EXPECT_EQ(arrivals[static_cast<size_t>(i)].at_us, kMilli * i);
  }
}

// 20,000 packets at 10 %: the share's standard deviation is 0.0021.
TEST(LinkEmulator, LosesItsShareWithoutMemory) {
  LinkConditions conditions;
  conditions.loss = 0.1;
  const std::vector<int> numbers = NumbersOf(SendOver(conditions));
  EXPECT_NEAR(static_cast<double>(numbers.size()) / kMany, 0.9, 0.01);
  EXPECT_TRUE(std::is_sorted(numbers.begin(), numbers.end()));
  // The packet after a lost one is lost no more often: of all pairs 0.9 * 0.9 arrive.
  int pairs = 0;
  for (size_t i = 1; i < numbers.size(); ++i) {
    pairs += numbers[i] == numbers[i - 1] + 1 ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(pairs) / kMany, 0.81, 0.015);
}

TEST(LinkEmulator, DelaysEveryPacketByTheSame) {
  LinkConditions conditions;
  conditions.delay_ms = 2000;
  for (const Arrival& arrival : SendOver(conditions)) {
    ASSERT_EQ(arrival.at_us, kMilli * arrival.number + 2 * kSecond);
  }
}

TEST(LinkEmulator, JitterIsUniform) {
  LinkConditions conditions;
  conditions.delay_ms = 50;
  conditions.jitter_ms = 40;
  double sum = 0, sum_of_squares = 0;
  const auto arrivals = SendOver(conditions);
  ASSERT_EQ(arrivals.size(), size_t{kMany});
  for (const Arrival& arrival : arrivals) {
    const double delay_ms = 1e-3 * static_cast<double>(arrival.at_us - kMilli * arrival.number);
    ASSERT_GE(delay_ms, 50);
    ASSERT_LE(delay_ms, 90);
    sum += delay_ms;
    sum_of_squares += delay_ms * delay_ms;
  }
  const double mean = sum / kMany;
  EXPECT_NEAR(mean, 70, 0.5);
  EXPECT_NEAR(sum_of_squares / kMany - mean * mean, 40 * 40 / 12.0, 5);
}

TEST(LinkEmulator, ReorderedPacketsAreOvertakenByAFew) {
  LinkConditions conditions;
  conditions.reorder = 0.02;
  LinkEmulator emulator(conditions, LinkDirection::kUp);
  const auto arrivals = Send(&emulator, kMany, kMilli);
  ASSERT_EQ(arrivals.size(), size_t{kMany});
  int highest = -1, late = 0;
  for (const Arrival& arrival : arrivals) {
    late += arrival.number < highest ? 1 : 0;
    highest = std::max(highest, arrival.number);
    // Held back packets do not count as overtakers of each other.
    EXPECT_LE(arrival.at_us - kMilli * arrival.number, 2 * LinkEmulator::kMaxOvertakers * kMilli);
  }
  EXPECT_NEAR(late, 0.02 * kMany, 60);
  EXPECT_EQ(emulator.counts().reordered, late);
}

TEST(LinkEmulator, AHeldPacketThatNobodyFollowsArrives) {
  LinkConditions conditions;
  conditions.reorder = 1;
  LinkEmulator emulator(conditions, LinkDirection::kUp);
  emulator.Add(0, Numbered(0));
  ASSERT_EQ(emulator.next_due_us(), LinkEmulator::kLongestHold_us);
  EXPECT_EQ(emulator.TakeDue(LinkEmulator::kLongestHold_us).size(), 1u);
}

// If every packet is held back, none overtakes another.
TEST(LinkEmulator, HeldPacketsAreForgottenWhenTheyArrive) {
  LinkConditions conditions;
  conditions.reorder = 1;
  LinkEmulator emulator(conditions, LinkDirection::kUp);
  EXPECT_EQ(Send(&emulator, kMany, kMilli).size(), size_t{kMany});
  EXPECT_EQ(emulator.held_back(), 0u);
}

TEST(LinkEmulator, DoublesItsShare) {
  LinkConditions conditions;
  conditions.duplicate = 0.05;
  LinkEmulator emulator(conditions, LinkDirection::kUp);
  std::map<int, int> copies;
  for (const Arrival& arrival : Send(&emulator, kMany, kMilli)) {
    ++copies[arrival.number];
  }
  EXPECT_EQ(copies.size(), size_t{kMany});
  const auto doubled =
      std::count_if(copies.begin(), copies.end(), [](const auto& c) { return c.second == 2; });
  EXPECT_NEAR(static_cast<double>(doubled), 0.05 * kMany, 100);
  EXPECT_EQ(emulator.counts().doubled, doubled);
  EXPECT_EQ(emulator.counts().delivered, kMany + doubled);
}

TEST(LinkEmulator, NothingEntersAPartition) {
  LinkConditions conditions;
  conditions.delay_ms = 100;
  conditions.partitions = {{2, 3}, {10, 1}};
  for (const Arrival& arrival : SendOver(conditions)) {
    const int64_t sent_us = kMilli * arrival.number;
    ASSERT_FALSE(sent_us >= 2 * kSecond && sent_us < 5 * kSecond);
    ASSERT_FALSE(sent_us >= 10 * kSecond && sent_us < 11 * kSecond);
  }
  LinkEmulator emulator(conditions, LinkDirection::kUp);
  EXPECT_EQ(Send(&emulator, kMany, kMilli).size(), size_t{kMany} - 4000);
  EXPECT_EQ(emulator.counts().cut, 4000);
}

LinkConditions Everything(uint64_t seed) {
  LinkConditions conditions;
  conditions.loss = 0.1;
  conditions.reorder = 0.05;
  conditions.duplicate = 0.05;
  conditions.seed = seed;
  return conditions;
}

TEST(LinkEmulator, TheSeedDecidesAlone) {
  EXPECT_EQ(NumbersOf(SendOver(Everything(1))), NumbersOf(SendOver(Everything(1))));
  EXPECT_NE(NumbersOf(SendOver(Everything(1))), NumbersOf(SendOver(Everything(2))));
  EXPECT_NE(NumbersOf(SendOver(Everything(1))),
            NumbersOf(SendOver(Everything(1), kMilli, LinkDirection::kDown)));
}

TEST(LinkEmulator, DecisionsDoNotDependOnTime) {
  const auto fates = [](int64_t spacing_us) {
    std::vector<int> numbers = NumbersOf(SendOver(Everything(3), spacing_us));
    std::sort(numbers.begin(), numbers.end());
    return numbers;
  };
  EXPECT_EQ(fates(kMilli), fates(37 * kMilli));
}

TEST(LinkEmulator, TheQueueIsBounded) {
  LinkConditions conditions;
  conditions.delay_ms = 1000;
  LinkEmulator emulator(conditions, LinkDirection::kUp);
  const std::vector<uint8_t> packet(1 << 20);
  for (int i = 0; i < 40; ++i) {
    emulator.Add(i, packet);
  }
  EXPECT_EQ(emulator.under_way(), 32u);
  EXPECT_EQ(emulator.counts().overflowed, 8);
  EXPECT_EQ(emulator.TakeDue(2 * kSecond).size(), 32u);
  emulator.Add(2 * kSecond, packet);
  EXPECT_EQ(emulator.under_way(), 1u);
}

TEST(LinkEmulatorProcess, RelaysOneAgentBothWays) {
  LocalBus agent, server, status;
  LinkConditions conditions;
  conditions.delay_ms = 10;
  LinkEmulatorProcess process(agent, server, status, 3, conditions, kSecond);
  std::vector<std::string> heard;
  const auto note = [&heard](const std::string& where) {
    return [&heard, where](const std::string& channel, Bytes data) {
      heard.push_back(where + " " + channel + " " + std::to_string(data[0]));
    };
  };
  server.Subscribe("LINK_UP_.*", note("server"));
  agent.Subscribe("LINK_DOWN_.*", note("agent"));
  agent.Publish(channels::LinkUp(3), Numbered(1));
  agent.Publish(channels::LinkUp(4), Numbered(2));
  server.Publish(channels::LinkDown(3), Numbered(3));
  agent.Drain();
  server.Drain();
  EXPECT_EQ(process.Poll(kSecond), 10) << "milliseconds to wait";
  process.Poll(kSecond + 10 * kMilli);
  agent.Drain();
  server.Drain();
  EXPECT_THAT(heard, testing::UnorderedElementsAre("server LINK_UP_3 1", "agent LINK_DOWN_3 3"));

  std::optional<status_t> told;
  status.Subscribe(channels::Status("link_emulator_3"), [&told](const std::string&, Bytes data) {
    EXPECT_TRUE(DecodeMessage(data, &told.emplace()));
  });
  process.Tick(kSecond);
  status.Drain();
  ASSERT_TRUE(told);
  EXPECT_THAT(told->summary, testing::HasSubstr("delay 10 ms: 1 of 1 packets delivered up"));
}

}  // namespace
}  // namespace pangea

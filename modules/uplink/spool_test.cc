#include "uplink/spool.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <lcm/lcm-cpp.hpp>

#include "messages/testing/test_keyframes.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
constexpr int64_t kLarge = 1 << 30;
const MapId kMap{1, 1000};

class SpoolTest : public testing::Test {
 protected:
  void SetUp() override {
    folder =
        fs::path(testing::TempDir()) /
        (std::string("spool_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder);
  }
  void TearDown() override { fs::remove_all(folder); }
  static bool Add(Spool* spool, int32_t seq, const MapId& map = kMap) {
    return spool->Add({map, seq}, EncodeTestKeyframe({map, seq}), seq);
  }
  std::vector<fs::path> Files() const {
    std::vector<fs::path> files(fs::directory_iterator(folder), {});
    std::sort(files.begin(), files.end());
    return files;
  }
  fs::path folder;
};

TEST_F(SpoolTest, WhatWasKeptIsThereAfterARestart) {
  {
    Spool spool(folder, 1, kLarge);
    for (int seq = 0; seq < 5; ++seq) {
      EXPECT_TRUE(Add(&spool, seq));
    }
    spool.Release(kMap, 1);
  }
  Spool spool(folder, 1, kLarge);
  EXPECT_TRUE(Add(&spool, 5));
  EXPECT_TRUE(Add(&spool, 3)) << "a repeat";
  // The first segment still has what was acknowledged; the server says so again.
  spool.Release(kMap, 1);
  const auto kept = spool.Kept();
  ASSERT_EQ(kept.size(), 4u);
  EXPECT_EQ(kept[0], (KeyframeId{kMap, 2}));
  for (const KeyframeId& id : kept) {
    EXPECT_EQ(spool.Read(id), EncodeTestKeyframe(id));
  }
  EXPECT_EQ(Files().size(), 2u);
  spool.Release(kMap, 5);
  EXPECT_EQ(Files().size(), 1u) << "the one that is written to stays while it is small";
}

TEST_F(SpoolTest, AnyLcmToolReadsIt) {
  Spool spool(folder, 1, kLarge);
  Add(&spool, 0);
  Add(&spool, 1);
  lcm::LogFile file(Files()[0].string(), "r");
  ASSERT_TRUE(file.good());
  for (int seq = 0; seq < 2; ++seq) {
    const lcm::LogEvent* event = file.readNextEvent();
    ASSERT_NE(event, nullptr);
    EXPECT_EQ(event->channel, "KEYFRAME_1");
    EXPECT_EQ(event->timestamp, seq);
    const auto* bytes = static_cast<const uint8_t*>(event->data);
    EXPECT_EQ(std::vector<uint8_t>(bytes, bytes + event->datalen), EncodeTestKeyframe({kMap, seq}));
  }
  EXPECT_EQ(file.readNextEvent(), nullptr);
}

// Cut at every place of the last keyframe's event.
TEST_F(SpoolTest, ATornTailIsIgnored) {
  {
    Spool spool(folder, 1, kLarge);
    Add(&spool, 0);
    Add(&spool, 1);
  }
  const fs::path file = Files()[0];
  const auto whole = fs::file_size(file);
  for (const uint64_t cut : {1, 100, 20'000}) {
    fs::resize_file(file, whole - cut);
    Spool spool(folder, 1, kLarge);
    EXPECT_EQ(spool.Kept().size(), 1u) << cut;
    EXPECT_EQ(spool.Read({kMap, 0}), EncodeTestKeyframe({kMap, 0}));
  }
}

TEST_F(SpoolTest, DamageIsNotSent) {
  Spool spool(folder, 1, kLarge);
  Add(&spool, 0);
  std::fstream file(Files()[0], std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(60);
  file << std::string(2000, '\xff');
  file.close();
  EXPECT_TRUE(spool.Read({kMap, 0}).empty());
}

TEST_F(SpoolTest, FullSaysNoAndHasRoomAgain) {
  const auto size = static_cast<int64_t>(EncodeTestKeyframe({kMap, 0}).size());
  Spool spool(folder, 1, 45 * size);
  int seq = 0;
  while (Add(&spool, seq)) {
    ++seq;
  }
  EXPECT_TRUE(spool.refuses());
  EXPECT_NEAR(seq, 44, 1);
  EXPECT_LE(spool.bytes(), 45 * size);
  spool.Release(kMap, seq - 1);
  EXPECT_EQ(spool.bytes(), 0);
  EXPECT_TRUE(Add(&spool, seq));
  EXPECT_FALSE(spool.refuses());
}

TEST_F(SpoolTest, WhatAnEarlierRunKeptCountsTowardsTheBound) {
  const auto size = static_cast<int64_t>(EncodeTestKeyframe({kMap, 0}).size());
  int seq = 0;
  for (int run = 0; run < 3; ++run) {
    Spool spool(folder, 1, 45 * size);
    while (seq < 20 * (run + 1) && Add(&spool, seq)) {
      ++seq;
    }
  }
  EXPECT_NEAR(seq, 44, 1);
}

TEST_F(SpoolTest, BeginsANewSegmentWhenOneIsFull) {
  Spool spool(folder, 1, kLarge);
  int seq = 0;
  while (spool.bytes() < Spool::kSegmentBytes) {
    ASSERT_TRUE(Add(&spool, seq++));
  }
  EXPECT_EQ(Files().size(), 1u);
  ASSERT_TRUE(Add(&spool, seq));
  EXPECT_EQ(Files().size(), 2u);
  spool.Release(kMap, seq - 1);
  EXPECT_EQ(Files().size(), 1u);
}

TEST_F(SpoolTest, ADiskThatRefusesHeals) {
  std::signal(SIGXFSZ, SIG_IGN);
  Spool spool(folder, 1, kLarge);
  Add(&spool, 0);
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  const rlimit full{static_cast<rlim_t>(spool.bytes() + 1000), limit.rlim_max};
  setrlimit(RLIMIT_FSIZE, &full);
  const bool taken = Add(&spool, 1);
  setrlimit(RLIMIT_FSIZE, &limit);
  EXPECT_FALSE(taken);
  EXPECT_TRUE(Add(&spool, 2));
  EXPECT_EQ(spool.Read({kMap, 2}), EncodeTestKeyframe({kMap, 2}));
  EXPECT_EQ(spool.Kept().size(), 2u);
}

// Its keyframes would go out under this agent's name, and never be taken.
TEST_F(SpoolTest, AnotherAgentsIsRefusedAndStays) {
  const MapId other{2, 1000};
  {
    Spool spool(folder, 2, kLarge);
    Add(&spool, 0, other);
  }
  EXPECT_THROW(Spool(folder, 1, kLarge), std::runtime_error);
  EXPECT_THAT(Spool(folder, 2, kLarge).Kept(), testing::ElementsAre(KeyframeId{other, 0}));
}

TEST_F(SpoolTest, BelongsToOneProcess) {
  const Spool spool(folder, 1, kLarge);
  EXPECT_THROW(Spool(folder, 1, kLarge), std::runtime_error);
}

}  // namespace
}  // namespace pangea

#include "uplink/spool.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <random>

#include "files/testing/full_disk.h"
#include "messages/encoding.h"
#include "messages/testing/test_keyframes.h"
#include "uplink/test_ids.h"
#include "uplink/thin.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
constexpr int64_t kLarge = 1 << 30;

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
  static void Flip(const fs::path& path, int64_t offset, int bits = 1) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(offset);
    const auto byte = static_cast<char>(file.get() ^ bits);
    file.seekp(offset);
    file.put(byte);
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
    event = file.readNextEvent();
    ASSERT_NE(event, nullptr);
    EXPECT_EQ(event->channel, "CHECKSUMS");
  }
  EXPECT_EQ(file.readNextEvent(), nullptr);
}

// As a crash leaves it, cut anywhere in the last keyframe or its checksum: that is no damage.
TEST_F(SpoolTest, ATornTailIsIgnored) {
  {
    Spool spool(folder, 1, kLarge);
    Add(&spool, 0);
    Add(&spool, 1);
  }
  const fs::path file = Files()[0];
  const auto whole = fs::file_size(file);
  for (const uint64_t cut : {1, 200, 20'000}) {
    fs::resize_file(file, whole - cut);
    Spool spool(folder, 1, kLarge);
    EXPECT_EQ(spool.Kept().size(), cut == 1 ? 2u : 1u) << cut;
    for (const KeyframeId& id : spool.Kept()) {
      EXPECT_EQ(spool.Read(id), EncodeTestKeyframe(id));
    }
    EXPECT_EQ(spool.num_damaged(), 0);
  }
  Spool(folder, 1, kLarge).Release(kMap, 1);
  EXPECT_TRUE(Files().empty());
}

TEST_F(SpoolTest, DamageIsNotSentAndTakenAnew) {
  Spool spool(folder, 1, kLarge);
  Add(&spool, 0);
  Add(&spool, 1);
  Flip(Files()[0], 20'000);
  EXPECT_TRUE(spool.Read({kMap, 0}).empty());
  EXPECT_EQ(spool.num_damaged(), 1);
  EXPECT_TRUE(Add(&spool, 0));
  EXPECT_EQ(spool.Read({kMap, 0}), EncodeTestKeyframe({kMap, 0}));
  EXPECT_EQ(spool.Read({kMap, 1}), EncodeTestKeyframe({kMap, 1}));
}

// It was deleted, with all that was in it.
TEST_F(SpoolTest, ADamagedFirstByteCostsOneKeyframeAndTheFileStays) {
  {
    Spool spool(folder, 1, kLarge);
    for (int seq = 0; seq < 5; ++seq) {
      Add(&spool, seq);
    }
  }
  Flip(Files()[0], 0);
  const auto size = static_cast<int64_t>(fs::file_size(Files()[0]));
  {
    Spool spool(folder, 1, kLarge);
    EXPECT_EQ(spool.Kept().size(), 4u);
    for (const KeyframeId& id : spool.Kept()) {
      EXPECT_EQ(spool.Read(id), EncodeTestKeyframe(id));
    }
    spool.Release(kMap, 4);
    ASSERT_EQ(Files().size(), 1u);
    EXPECT_THAT(Files()[0].filename().string(),
                testing::MatchesRegex("keyframes_000001\\.lcm\\.damaged-[0-9]{8}T[0-9]{6}Z"));
    EXPECT_EQ(spool.bytes(), 0);
    EXPECT_EQ(spool.damaged_bytes(), size);
  }
  Spool spool(folder, 1, size + 1000);
  EXPECT_EQ(spool.damaged_bytes(), size);
  EXPECT_TRUE(spool.Kept().empty());
  EXPECT_FALSE(Add(&spool, 9)) << "it counts towards the bound";
}

TEST_F(SpoolTest, AFileOfNothingButDamageStays) {
  {
    Spool spool(folder, 1, kLarge);
    Add(&spool, 0);
  }
  fs::resize_file(Files()[0], 10'000);
  Flip(Files()[0], 0);
  EXPECT_TRUE(Spool(folder, 1, kLarge).Kept().empty());
  ASSERT_EQ(Files().size(), 1u);
  EXPECT_EQ(fs::file_size(Files()[0]), 10'000u);
}

// Without its checksum the agent's id would be another's, and the uplink would not start.
TEST_F(SpoolTest, ADamagedIdIsNoOtherAgents) {
  {
    Spool spool(folder, 1, kLarge);
    Add(&spool, 0);
    Add(&spool, 1);
  }
  constexpr int64_t kAgentsByte = 28 + 10 + 8 + 2;
  Flip(Files()[0], kAgentsByte);
  EXPECT_THAT(Spool(folder, 1, kLarge).Kept(), testing::ElementsAre(KeyframeId{kMap, 1}));
}

// The damage is single bits and blocks of 4 kB.
TEST_F(SpoolTest, RandomDamageLosesTheKeyframesItHitsAtMost) {
  constexpr int kKeyframes = 8;
  {
    Spool spool(folder, 1, kLarge);
    for (int seq = 0; seq < kKeyframes; ++seq) {
      Add(&spool, seq);
    }
  }
  const fs::path file = Files()[0];
  const fs::path good = folder.string() + "_good";
  fs::copy_file(file, good, fs::copy_options::overwrite_existing);
  const auto event_bytes = static_cast<int64_t>(fs::file_size(file)) / kKeyframes;
  std::mt19937_64 random(5);
  for (const int64_t size : {1, 4096}) {
    int64_t hit = 0, lost = 0, worst = 0;
    for (int i = 0; i < 200; ++i) {
      fs::remove_all(folder);
      fs::create_directories(folder);
      fs::copy_file(good, file);
      const auto at =
          static_cast<int64_t>(random() % static_cast<uint64_t>(event_bytes * kKeyframes - size));
      for (int64_t k = 0; k < size; ++k) {
        Flip(file, at + k, size == 1 ? 1 << random() % 8 : static_cast<int>(random() % 256));
      }
      Spool spool(folder, 1, kLarge);
      const int64_t hits = (at + size - 1) / event_bytes - at / event_bytes + 1;
      int64_t good_ones = 0;
      for (const KeyframeId& id : spool.Kept()) {
        const std::vector<uint8_t> read = spool.Read(id);
        good_ones += read == EncodeTestKeyframe(id) ? 1 : 0;
      }
      EXPECT_GE(good_ones, kKeyframes - hits) << at;
      hit += hits;
      lost += kKeyframes - good_ones;
      worst = std::max(worst, kKeyframes - good_ones);
      spool.Release(kMap, kKeyframes);
      EXPECT_EQ(Files().size(), spool.num_damaged() > 0 ? 1u : 0u);
    }
    fmt::print("| {} | 200 | {} | {} | {} |\n", size == 1 ? "one bit" : "4 kB", hit, lost, worst);
  }
  fs::remove(good);
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
  Spool spool(folder, 1, kLarge);
  Add(&spool, 0);
  {
    const FullDisk full(static_cast<uint64_t>(spool.bytes() + 1000));
    EXPECT_FALSE(Add(&spool, 1));
  }
  EXPECT_TRUE(Add(&spool, 2));
  EXPECT_EQ(spool.Read({kMap, 2}), EncodeTestKeyframe({kMap, 2}));
  EXPECT_EQ(spool.Kept().size(), 2u);
}

// The part of an event that a full disk took was longer than the event after it.
TEST_F(SpoolTest, AFullDiskIsNoDamage) {
  {
    Spool spool(folder, 1, kLarge);
    Add(&spool, 0);
    const FullDisk full(static_cast<uint64_t>(spool.bytes() + 5000));
    EXPECT_FALSE(Add(&spool, 1));
    const KeyframeId next{kMap, 2};
    EXPECT_TRUE(spool.Add(next, EncodeMessage(ToMessage(Bare(TestKeyframe(next)))), 2));
  }
  const Spool spool(folder, 1, kLarge);
  EXPECT_EQ(spool.num_damaged(), 0);
  EXPECT_EQ(spool.Kept().size(), 2u);
}

// A folder cannot be read, as a bad sector cannot.
TEST_F(SpoolTest, AFileThatCannotBeReadIsDamageAndStays) {
  {
    Spool spool(folder, 1, kLarge);
    Add(&spool, 0);
  }
  fs::create_directories(folder / "keyframes_000007.lcm" / "kept");
  Spool spool(folder, 1, kLarge);
  EXPECT_EQ(spool.num_damaged(), 1);
  EXPECT_THAT(spool.Kept(), testing::ElementsAre(KeyframeId{kMap, 0}));
  EXPECT_EQ(Files().size(), 2u);
  EXPECT_TRUE(Add(&spool, 1));
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

#include "checkpoint/checkpoint_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <numeric>
#include <string>
#include <vector>

#include "files/testing/full_disk.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

const CheckpointKey kKey{"posegraph", 3, "scope: all\n"};
const JournalState kJournal{1000, 900, 77};

class CheckpointFile : public testing::Test {
 protected:
  CheckpointFile() { fs::remove_all(folder_); }
  ~CheckpointFile() override { fs::remove_all(folder_); }

  void Write(int32_t first = 1, const CheckpointKey& key = kKey) const {
    CheckpointWriter writer(file(), key, kJournal);
    writer.Put(std::vector<int32_t>{first, 2, 3});
    writer.Commit();
  }
  // The reason why the checkpoint is not used; empty if it is used.
  std::string Refused(const CheckpointKey& key = kKey) const {
    try {
      CheckpointReader reader(file(), key);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }
  int32_t First() const {
    CheckpointReader reader(file(), kKey);
    std::vector<int32_t> values;
    reader.Get(&values);
    EXPECT_TRUE(reader.ok() && reader.at_end());
    return values.at(0);
  }
  std::string Bytes() const {
    std::ifstream in(file(), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void Overwrite(const std::string& bytes) const {
    std::ofstream(file(), std::ios::binary | std::ios::trunc) << bytes;
  }
  size_t NumFiles() const {
    return static_cast<size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }
  fs::path file() const { return folder_ / "posegraph"; }

  const fs::path folder_ =
      fs::path(testing::TempDir()) / ("checkpoint_" + std::to_string(getpid()));
};

// In a process of its own; how that ended.
int InChild(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    work();
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

TEST_F(CheckpointFile, ComesBackAsItWasWithWhatItIsOf) {
  Write(5);
  CheckpointReader reader(file(), kKey);
  EXPECT_EQ(reader.head().journal, kJournal);
  EXPECT_EQ(reader.head().key.process, "posegraph");
  EXPECT_EQ(First(), 5);
  EXPECT_EQ(NumFiles(), 1u);
}

TEST_F(CheckpointFile, ManyMegabytesComeBackInPiecesOfAnySize) {
  std::vector<uint32_t> large(700'000);
  std::iota(large.begin(), large.end(), 0);
  CheckpointWriter writer(file(), kKey, kJournal);
  for (const uint32_t value : large) {
    writer.Put(value);
  }
  writer.Put(large);
  writer.Commit();
  CheckpointReader reader(file(), kKey);
  for (const uint32_t value : large) {
    uint32_t read = 0;
    reader.Get(&read);
    ASSERT_EQ(read, value);
  }
  std::vector<uint32_t> read;
  reader.Get(&read);
  EXPECT_EQ(read, large);
  EXPECT_TRUE(reader.ok() && reader.at_end());
}

TEST_F(CheckpointFile, OfAnotherProcessVersionOrOptionsIsNotUsed) {
  Write();
  EXPECT_EQ(Refused({"fusion", kKey.format, kKey.options}), "it is one of posegraph");
  EXPECT_EQ(Refused({kKey.process, 4, kKey.options}), "it is of another version");
  EXPECT_EQ(Refused({kKey.process, kKey.format, "scope: paper\n"}),
            "it was made with other options");
  EXPECT_EQ(Refused(), "");
}

TEST_F(CheckpointFile, TornAnywhereIsNotUsed) {
  Write();
  const std::string whole = Bytes();
  for (size_t size = 0; size < whole.size(); ++size) {
    Overwrite(whole.substr(0, size));
    EXPECT_NE(Refused(), "") << size;
  }
  Overwrite(whole + '\0');
  EXPECT_EQ(Refused(), "it is torn");
  Overwrite(whole);
  EXPECT_EQ(Refused(), "");
}

TEST_F(CheckpointFile, AFlippedBitInAnyByteIsSeen) {
  Write();
  const std::string whole = Bytes();
  for (size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ (1 << i % 8));
    Overwrite(damaged);
    EXPECT_NE(Refused(), "") << i;
  }
}

TEST_F(CheckpointFile, WhatIsNotCommittedLeavesTheOneBefore) {
  Write(1);
  {
    CheckpointWriter writer(file(), kKey, kJournal);
    writer.Put(std::vector<int32_t>{2});
  }
  EXPECT_EQ(First(), 1);
  EXPECT_EQ(NumFiles(), 1u);
}

TEST_F(CheckpointFile, KilledWhileWritingLeavesTheOneBefore) {
  Write(1);
  const int status = InChild([this] {
    CheckpointWriter writer(file(), kKey, kJournal);
    writer.Put(std::vector<uint8_t>(3'000'000));
    kill(getpid(), SIGKILL);
  });
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(First(), 1);
  Write(2);
  EXPECT_EQ(First(), 2);
  EXPECT_EQ(NumFiles(), 1u);
}

TEST_F(CheckpointFile, FullDiskIsAnErrorAndLeavesTheOneBefore) {
  Write(1);
  const int status = InChild([this] {
    const FullDisk full(2'000'000);
    try {
      CheckpointWriter writer(file(), kKey, kJournal);
      writer.Put(std::vector<uint8_t>(3'000'000));
      writer.Commit();
    } catch (const std::runtime_error& error) {
      const bool names_it = std::string(error.what()).starts_with(file().string());
      _exit(names_it ? 7 : 8);
    }
  });
  EXPECT_EQ(WEXITSTATUS(status), 7);
  EXPECT_EQ(First(), 1);
  EXPECT_EQ(NumFiles(), 1u);
}

}  // namespace
}  // namespace pangea

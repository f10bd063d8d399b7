// Tests what happens around the opening of a journal, with system calls that the test watches.

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>
#include <utility>

#include "agent_handler/journal/journal.h"

namespace {

int num_syncs = 0;
std::function<void()> before_lock;

}  // namespace

// These replace the C library's functions in this program.
extern "C" int fdatasync(int fd) {
  ++num_syncs;
  return static_cast<int>(syscall(SYS_fdatasync, fd));
}
extern "C" int flock(int fd, int operation) {
  if (before_lock) {
    std::exchange(before_lock, nullptr)();
  }
  return static_cast<int>(syscall(SYS_flock, fd, operation));
}

namespace pangea {
namespace {

class JournalOpening : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
    Journal journal(path, visitor);
    journal.Append(1, "KEYFRAME_1", std::vector<uint8_t>(100));
    ASSERT_TRUE(journal.Sync());
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  const Journal::Visitor visitor = [](const std::string&, Bytes, const JournalPlace&) {
    return true;
  };
  const std::string folder =
      testing::TempDir() + "pangea_journal_opening_" + std::to_string(getpid());
  const std::string path = folder + "/journal.lcm";
};

// A run that was killed may have written it, and not waited for the disk.
TEST_F(JournalOpening, BringsWhatItFindsToTheDisk) {
  num_syncs = 0;
  const Journal journal(path, visitor);
  EXPECT_EQ(num_syncs, 1);
}

// As a compaction does it. All that is written to the old journal would be lost.
TEST_F(JournalOpening, RefusesAJournalThatIsReplacedMeanwhile) {
  std::filesystem::copy_file(path, path + ".new");
  before_lock = [this] { std::filesystem::rename(path + ".new", path); };
  EXPECT_THROW(Journal(path, visitor), std::runtime_error);
  EXPECT_NO_THROW(Journal(path, visitor));
}

}  // namespace
}  // namespace pangea

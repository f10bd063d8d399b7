#include "gateway/recording/recording_folder.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/statfs.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <fstream>
#include <optional>
#include <vector>

#include "files/text_file.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

Bytes BytesOf(std::string_view text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

// Bytes of the file whose way to the disk has not begun. Nothing before Linux 6.5, and where files
// are in memory.
std::optional<int64_t> DirtyBytes(const fs::path& file) {
  constexpr int64_t kCacheStat = 451;  // of Linux 6.5, which glibc does not name yet
  constexpr int64_t kTmpfs = 0x01021994;
  struct {
    uint64_t offset = 0, size = 0;
  } whole;
  struct {
    uint64_t cached, dirty, under_way, evicted, evicted_recently;
  } pages{};
  struct statfs system {};
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const bool known = fstatfs(fd, &system) == 0 && system.f_type != kTmpfs &&
                     syscall(kCacheStat, fd, &whole, &pages, 0) == 0;
  close(fd);
  return known ? std::optional(static_cast<int64_t>(pages.dirty) * sysconf(_SC_PAGESIZE))
               : std::nullopt;
}

class RecordingFolderTest : public testing::Test {
 protected:
  RecordingFolderTest() { fs::remove_all(folder_); }
  static int64_t NumFiles(const fs::path& folder) {
    return std::distance(fs::directory_iterator(folder), {});
  }

  const fs::path folder_ = testing::TempDir() + "/recordings";
};

TEST_F(RecordingFolderTest, KeepsWhatIsFinishedUnderATimeAndAnAgent) {
  RecordingFolder recordings(folder_, 1000);
  EXPECT_EQ(recordings.Begin(7, 6), "");
  EXPECT_EQ(recordings.Write(7, BytesOf("abc")), "");
  EXPECT_EQ(recordings.Write(7, BytesOf("def")), "");
  const auto kept = recordings.Finish(7);
  EXPECT_EQ(kept.error, "");
  EXPECT_TRUE(kept.file.ends_with("Z_agent_7.zip")) << kept.file;
  EXPECT_EQ(ReadTextFile(folder_ / kept.file), "abcdef");
  EXPECT_EQ(fs::status(folder_ / kept.file).permissions(),
            fs::perms::owner_read | fs::perms::owner_write);

  recordings.Begin(7, 1);
  recordings.Write(7, BytesOf("x"));
  EXPECT_NE(recordings.Finish(7).file, kept.file) << "in the same second";
}

TEST_F(RecordingFolderTest, RefusesWhatIsBeyondItsRoom) {
  RecordingFolder recordings(folder_, 10);
  EXPECT_EQ(recordings.Begin(7, 6), "");
  EXPECT_THAT(recordings.Begin(8, 5), HasSubstr("no room")) << "with what is under way";
  recordings.Write(7, BytesOf("abcdef"));
  recordings.Finish(7);
  EXPECT_THAT(recordings.Begin(8, 5), HasSubstr("no room")) << "with what is kept";
  EXPECT_EQ(recordings.Begin(8, 4), "");
}

TEST_F(RecordingFolderTest, CountsWhatAPersonUnpackedThere) {
  RecordingFolder recordings(folder_, 10);
  fs::create_directories(folder_ / "walk" / "mav0");
  std::ofstream(folder_ / "walk" / "mav0" / "a.jpg") << "12345";
  EXPECT_EQ(recordings.Begin(7, 5), "");
  EXPECT_THAT(recordings.Begin(7, 6), HasSubstr("no room"));
}

// Else the end of a large upload would block the gateway for seconds.
TEST_F(RecordingFolderTest, LittleWaitsForTheDiskAtTheEnd) {
  RecordingFolder recordings(folder_, 100'000'000);
  EXPECT_EQ(recordings.Begin(7, 30'000'000), "");
  const std::vector<uint8_t> part(60'000);
  for (int i = 0; i < 500; ++i) {
    EXPECT_EQ(recordings.Write(7, part), "");
  }
  const std::optional<int64_t> dirty = DirtyBytes(folder_ / "agent_7.part");
  if (!dirty) {
    GTEST_SKIP() << "the system does not tell";
  }
  EXPECT_LT(*dirty, 5'000'000);
  EXPECT_EQ(recordings.Finish(7).error, "");
}

TEST_F(RecordingFolderTest, NothingStaysOfWhatIsNotFinished) {
  {
    RecordingFolder recordings(folder_, 1000);
    recordings.Begin(7, 6);
    recordings.Abort(7);
    EXPECT_EQ(NumFiles(folder_), 0);
    recordings.Begin(8, 6);
  }
  EXPECT_EQ(NumFiles(folder_), 0);
  std::ofstream(folder_ / "agent_9.part") << "of a gateway that was killed";
  RecordingFolder recordings(folder_, 1000);
  EXPECT_EQ(NumFiles(folder_), 0);
}

}  // namespace
}  // namespace pangea

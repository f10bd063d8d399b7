#include "files/disk_io.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace pangea {
namespace {

class DiskIo : public testing::Test {
 protected:
  DiskIo() : fd_(open(path_.c_str(), O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600)) {}
  ~DiskIo() override {
    close(fd_);
    std::filesystem::remove(path_);
  }

  const std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / ("disk_io_test-" + std::to_string(getpid()));
  const int fd_;
};

TEST_F(DiskIo, ReadsWhatWasWritten) {
  ASSERT_TRUE(WriteFully(fd_, 0, "abcdef", 6));
  ASSERT_TRUE(WriteFully(fd_, 2, "XY", 2));
  std::string read(6, ' ');
  ASSERT_TRUE(ReadFully(fd_, 0, read.data(), read.size()));
  EXPECT_EQ(read, "abXYef");
  EXPECT_TRUE(TrySyncToDisk(path_));
}

TEST_F(DiskIo, TellsTheEndOfTheFileFromAnError) {
  ASSERT_TRUE(WriteFully(fd_, 0, "abc", 3));
  std::string read(4, ' ');
  EXPECT_FALSE(ReadFully(fd_, 0, read.data(), read.size()));
  EXPECT_EQ(errno, 0);
  EXPECT_FALSE(ReadFully(-1, 0, read.data(), read.size()));
  EXPECT_EQ(errno, EBADF);
}

TEST_F(DiskIo, SaysWhatCannotBeBroughtToTheDisk) {
  EXPECT_FALSE(TrySyncToDisk(path_ / "missing"));
  EXPECT_THROW(SyncToDisk(path_ / "missing"), std::runtime_error);
}

}  // namespace
}  // namespace pangea

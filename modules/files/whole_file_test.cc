#include "files/whole_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "files/make_folder.h"
#include "files/text_file.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

class WholeFile : public testing::Test {
 protected:
  WholeFile() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  int64_t NumFiles() const {
    return std::distance(fs::directory_iterator(folder_), fs::directory_iterator());
  }

  const fs::path folder_ = testing::TempDir() + "/whole_file";
};

TEST_F(WholeFile, ANewFileIsNotWrittenOverOne) {
  const fs::path file = folder_ / "a";
  EXPECT_TRUE(WriteNewFile(file, "first", 0600));
  EXPECT_FALSE(WriteNewFile(file, "second", 0644));
  EXPECT_EQ(ReadTextFile(file), "first");
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  ReplaceFile(file, "third", 0640);
  EXPECT_EQ(ReadTextFile(file), "third");
  EXPECT_EQ(fs::status(file).permissions() & fs::perms::group_all, fs::perms::group_read);
  EXPECT_EQ(NumFiles(), 1) << "nothing is left beside it";
}

TEST_F(WholeFile, OneOfThoseWhoRemoveItIsTold) {
  const fs::path file = folder_ / "a";
  WriteNewFile(file, "", 0600);
  EXPECT_TRUE(RemoveFile(file));
  EXPECT_FALSE(RemoveFile(file));
}

TEST_F(WholeFile, TextFilesAndFoldersSayWhy) {
  const auto why_not = [](const auto& call) -> std::string {
    try {
      call();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  MakeFolder(folder_ / "a" / "b");
  MakeFolder(folder_ / "a" / "b");
  WriteTextFile(folder_ / "a" / "file", "x");
  EXPECT_EQ(why_not([&] { WriteTextFile(folder_ / "a" / "b", "x"); }),
            (folder_ / "a" / "b").string() + ": cannot be written: Is a directory");
  EXPECT_EQ(
      why_not([&] { MakeFolder(folder_ / "a" / "file" / "c"); }),
      "the folder " + (folder_ / "a" / "file" / "c").string() + " cannot be made: Not a directory");
}

TEST_F(WholeFile, SaysWhatCannotBeWritten) {
  EXPECT_THROW(WriteNewFile(folder_ / "missing" / "a", "", 0600), std::runtime_error);
  fs::create_directories(folder_ / "folder");
  EXPECT_THROW(ReplaceFile(folder_ / "folder", "", 0600), std::runtime_error);
  EXPECT_THROW(RemoveFile(folder_ / "folder"), std::runtime_error);
  EXPECT_EQ(NumFiles(), 1);
}

}  // namespace
}  // namespace pangea

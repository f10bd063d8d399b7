#include "files/text_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <functional>
#include <stdexcept>

#include "files/csv.h"
#include "options/yaml_options.h"
#include "recording/test_complaint.h"
#include "recording/trajectory.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

class TextFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  std::string Path(const std::string& name) const { return folder_ + "/" + name; }

  const std::string folder_ = ::testing::TempDir() + "pangea_text_file";
};

TEST_F(TextFileTest, ReadsWhatWasWrittenAlsoByALink) {
  WriteTextFile(Path("a"), "one\ntwo");
  fs::create_symlink(Path("a"), Path("link"));
  EXPECT_EQ(ReadTextFile(Path("a")), "one\ntwo");
  EXPECT_EQ(ReadTextFile(Path("link")), "one\ntwo");
  EXPECT_TRUE(Exists(Path("link")));
}

TEST_F(TextFileTest, WhatIsNoFileIsNamedWithTheCause) {
  ASSERT_EQ(mkfifo(Path("fifo").c_str(), 0600), 0);
  fs::create_symlink("loop", Path("loop"));
  for (const auto& [path, why] :
       {std::pair(Path("none"), "No such file or directory"),
        {Path("loop"), "Too many levels of symbolic links"},
        {Path("fifo"), "it is a FIFO; only regular files are read"},
        {folder_, "it is a folder; only regular files are read"},
        {std::string("/dev/zero"), "it is a device; only regular files are read"}}) {
    EXPECT_EQ(Complaint([path = path] { OpenFile(path); }), path + ": cannot be opened: " + why);
  }
  EXPECT_FALSE(Exists(Path("loop")));
}

// A reader that opens such a file without a check would block here, or fill the memory.
TEST_F(TextFileTest, EveryReaderLooksFirst) {
  ASSERT_EQ(mkfifo(Path("fifo").c_str(), 0600), 0);
  for (const std::string& path : {Path("fifo"), std::string("/dev/zero")}) {
    std::vector<std::string> warnings;
    YamlOptions yaml;
    const std::string expected = path + ": cannot be opened: it is a ";
    using ::testing::StartsWith;
    EXPECT_THAT(Complaint([&] { ReadCsv(path); }), StartsWith(expected));
    EXPECT_THAT(Complaint([&] { ReadTrajectory(path, &warnings); }), StartsWith(expected));
    EXPECT_THAT(Complaint([&] { yaml.ReadFile(path); }), StartsWith(expected));
  }
}

}  // namespace
}  // namespace pangea

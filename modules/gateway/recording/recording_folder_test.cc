#include "gateway/recording/recording_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "files/text_file.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

Bytes BytesOf(std::string_view text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
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

#include "log_file/log_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "log_file/checksums.h"
#include "log_file/log_event.h"
#include "log_file/log_writer.h"
#include "messages/channels.h"

namespace pangea {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class LogReaderTest : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path); }

  void Add(const std::string& channel, uint8_t byte) {
    begins.push_back(file.size());
    const auto number = static_cast<int64_t>(begins.size()) - 1;
    AppendLogEvent(number, 1'000'000 * (number + 7), channel, std::vector<uint8_t>(100, byte),
                   &file);
  }
  void Fill(int count) {
    for (int i = 0; i < count; ++i) {
      Add("POSE_1", static_cast<uint8_t>(i));
    }
  }
  // Adds an event with the checksums of all events so far.
  void AddChecksums() {
    Checksums checksums;
    for (size_t i = 0; i < begins.size(); ++i) {
      const size_t end = i + 1 < begins.size() ? begins[i + 1] : file.size();
      checksums.crc32.push_back(EventChecksum(Bytes(file).subspan(begins[i], end - begins[i])));
    }
    begins.push_back(file.size());
    AppendChecksumsEvent(checksums, 8'000'000, &file);
  }
  void Save() const {
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(file.data()), std::ssize(file));
  }
  // The first byte of each event that the reader returns.
  std::vector<int> Read() {
    Save();
    std::vector<int> bytes;
    LogReadings readings;
    ReadLog(
        path, [&bytes](const LogEvent& event) { bytes.push_back(event.data[0]); }, &readings);
    reading = readings.at(path);
    return bytes;
  }
  // For each event, the part of the file that was read when the event was returned.
  std::vector<double> Shares() const {
    Save();
    LogReader log(path);
    std::vector<double> shares;
    while (log.Next() != nullptr) {
      shares.push_back(static_cast<double>(log.read_bytes()) /
                       static_cast<double>(log.file_bytes()));
    }
    return shares;
  }
  std::string Refusal(LogReadings* readings) const {
    Save();
    try {
      ReadLog(
          path, [](const LogEvent&) {}, readings);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  std::string path = testing::TempDir() + "log_reader_" +
                     testing::UnitTest::GetInstance()->current_test_info()->name();
  std::vector<uint8_t> file;
  std::vector<size_t> begins;  // of the events
  LogReading reading;
};

TEST_F(LogReaderTest, AWholeLogLosesNothing) {
  Fill(3);
  EXPECT_THAT(Read(), ElementsAre(0, 1, 2));
  EXPECT_TRUE(reading.whole());
  EXPECT_EQ(DescribeLoss(reading), "");
  EXPECT_THAT(LossLines({{"a.lcm", reading}}), ElementsAre());
  EXPECT_EQ(Refusal(nullptr), "");
}

TEST_F(LogReaderTest, SaysHowMuchItHasRead) {
  Fill(4);
  EXPECT_THAT(Shares(), ElementsAre(0.25, 0.5, 0.75, 1));
}

TEST_F(LogReaderTest, GoesOnBehindDamageAndSaysWhere) {
  Fill(5);
  file[begins[2]] ^= 1;
  EXPECT_THAT(Read(), ElementsAre(0, 1, 3, 4));
  EXPECT_EQ(DescribeLoss(reading),
            "1 damaged place, 134 bytes lost: 134 at byte 268 (between events 1 and 3, 1.000 to "
            "3.000 s)");
}

TEST_F(LogReaderTest, DamageAtTheBeginningAndAtTheEnd) {
  Fill(5);
  file[begins[0]] ^= 1;
  file[begins[3]] ^= 1;
  file.resize(file.size() - 1);
  EXPECT_THAT(Read(), ElementsAre(1, 2));
  EXPECT_EQ(DescribeLoss(reading),
            "2 damaged places, 401 bytes lost: 134 at byte 0 (before event 1); 267 at byte 402 "
            "(behind event 2, 1.000 s)");
}

TEST_F(LogReaderTest, NamesTheFirstOfManyPlaces) {
  Fill(21);
  for (size_t i = 1; i < 20; i += 2) {
    file[begins[i]] ^= 1;
  }
  EXPECT_EQ(Read().size(), 11U);
  EXPECT_EQ(reading.lost_places, 10);
  EXPECT_EQ(reading.lost_bytes, 1340);
  EXPECT_THAT(DescribeLoss(reading),
              AllOf(HasSubstr("between events 6 and 8"), Not(HasSubstr("events 8 and")),
                    HasSubstr("; and 6 more")));
}

TEST_F(LogReaderTest, ATornTailIsNoDamage) {
  Fill(3);
  file.resize(file.size() - 5);
  EXPECT_THAT(Read(), ElementsAre(0, 1));
  EXPECT_EQ(reading.torn_bytes, 129);
  EXPECT_THAT(DescribeLoss(reading),
              testing::StartsWith("ends in the middle of an event, its last 129 bytes are lost"));
}

TEST_F(LogReaderTest, WithoutReadingsALogMustBeWhole) {
  Fill(3);
  file[begins[1]] ^= 1;
  EXPECT_THAT(Refusal(nullptr), HasSubstr(": 1 damaged place"));
}

TEST_F(LogReaderTest, ChecksumsShowAFlippedBitInTheData) {
  Fill(4);
  AddChecksums();
  Add("POSE_1", 9);
  EXPECT_THAT(Read(), ElementsAre(0, 1, 2, 3, 9)) << "without the CHECKSUMS";
  EXPECT_EQ(reading.checksums, 1);
  EXPECT_TRUE(reading.whole());
  file[begins[2] + 70] ^= 1;
  file[begins[3] + 70] ^= 1;
  EXPECT_THAT(Read(), ElementsAre(0, 1, 9));
  EXPECT_EQ(reading.lost_places, 1) << "side by side";
  EXPECT_THAT(DescribeLoss(reading), HasSubstr("268 at byte 268 (between events 1 and 4"));
}

TEST_F(LogReaderTest, WhatItsWriterMarkedAsDamagedIsLostToo) {
  Fill(2);
  Add(std::string(channels::kDamaged), 77);
  Fill(1);
  Add("DAM", 77);
  EXPECT_THAT(Read(), ElementsAre(0, 1, 0));
  EXPECT_EQ(reading.events, 3);
  EXPECT_THAT(DescribeLoss(reading),
              AllOf(HasSubstr("2 damaged places"), HasSubstr("(2 found when")));
}

TEST_F(LogReaderTest, WhatIsNoLogIsRefused) {
  const std::string text = "Notes: buy milk, call the landlord about the roof.\n";
  file.assign(text.begin(), text.end());
  LogReadings readings;
  EXPECT_THAT(Refusal(&readings), HasSubstr("is no LCM log: its 51 bytes hold no whole event"));
  file.clear();
  EXPECT_THAT(Read(), ElementsAre()) << "nothing was captured";
  EXPECT_TRUE(reading.whole());
  Fill(1);
  file.resize(40);
  EXPECT_THAT(Read(), ElementsAre()) << "killed within the first event";
  EXPECT_EQ(reading.torn_bytes, 40);
}

std::string WhyNot(const std::function<void()>& open) {
  try {
    open();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(LogFiles, TellWhyTheyCannotBeOpened) {
  const std::string folder = testing::TempDir();
  EXPECT_EQ(WhyNot([] { LogFileWriter("no_folder/new.lcm"); }),
            "no_folder/new.lcm: cannot be written: No such file or directory");
  EXPECT_EQ(WhyNot([&] { LogFileWriter writer(folder); }),
            folder + ": cannot be written: Is a directory");
  EXPECT_EQ(WhyNot([&] { LogReader reader(folder); }),
            folder + ": is no file, but a folder or device");
  EXPECT_EQ(WhyNot([] { LogReader("no_folder/new.lcm"); }),
            "no_folder/new.lcm: there is no such log");
}

TEST(TellLosses, TellsInTheExitCode) {
  LogReading torn;
  torn.torn_bytes = 5;
  EXPECT_EQ(TellLosses("test", {{"whole.lcm", {}}}, 0), 0);
  EXPECT_EQ(TellLosses("test", {{"whole.lcm", {}}}, 2), 2);
  EXPECT_EQ(TellLosses("test", {{"torn.lcm", torn}}, 0), kExitLost);
  EXPECT_EQ(TellLosses("test", {{"torn.lcm", torn}}, 2), kExitLost);
  EXPECT_EQ(TellLosses("test", {{"torn.lcm", torn}}, 1), 1) << "it failed";
}

}  // namespace
}  // namespace pangea

// Tests every program that reads logs with damaged captures: it must read what is readable, report
// the loss, and show it by the exit code.

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "log_file/log_reading.h"
#include "log_file/log_scan.h"
#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

constexpr int kEvents = 629;
constexpr size_t kConstraint = 314;  // the index of a CONSTRAINT
constexpr size_t kPose = 400;        // the index of a POSE; 4 kB from here reach into a KEYFRAME_2

std::vector<LogPiece> Pieces(const std::string& log) {
  const int fd = open(log.c_str(), O_RDONLY | O_CLOEXEC);
  std::vector<LogPiece> pieces;
  LogScan scan(fd);
  while (auto piece = scan.Next()) {
    pieces.push_back(std::move(*piece));
  }
  close(fd);
  return pieces;
}

class DamagedLog : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new fs::path(FreshFolder("damaged_log"));
    const std::string whole = ReadFile(kSample);
    const std::vector<LogPiece> events = Pieces(kSample);
    ASSERT_EQ(events.size(), kEvents);
    std::string bytes = whole;
    bytes[static_cast<size_t>(events[kConstraint].offset)] ^= 4;
    Write("bit.lcm", bytes);
    bytes = whole;
    bytes.replace(static_cast<size_t>(events[kPose].offset), 4096, 4096, '\0');
    Write("block.lcm", bytes);
    Write("cut.lcm", whole.substr(0, whole.size() - 100));
    Write("notes.txt", "Notes: buy milk, call the landlord about the roof.\n");
  }
  static void TearDownTestSuite() {
    fs::remove_all(*folder_);
    delete folder_;
  }
  static void Write(const std::string& name, const std::string& bytes) {
    std::ofstream(*folder_ / name, std::ios::binary) << bytes;
  }
  // Runs a command in the folder of the damaged logs.
  static Outcome Run(const std::string& command) {
    return RunCommand(fmt::format("cd {} && {}", folder_->string(), command));
  }
  static nlohmann::json Json(const std::string& name) { return ReadJson(*folder_ / name); }
  static std::string Text(const std::string& name) { return ReadFile(*folder_ / name); }

  static fs::path* folder_;
};
fs::path* DamagedLog::folder_ = nullptr;

constexpr const char* kBit =
    "bit.lcm: 1 damaged place, 449 bytes lost: 449 at byte 996321 (between events 313 and 315, "
    "6.257 to 6.276 s)";

TEST_F(DamagedLog, InfoCountsTheOthersAndSaysWhere) {
  Outcome outcome = Run("pangea-log info bit.lcm");
  EXPECT_EQ(outcome.exit_code, kExitLost) << outcome.output;
  EXPECT_THAT(outcome.output, AllOf(HasSubstr("bit.lcm: 628 events"), HasSubstr(kBit)));
  outcome = Run("pangea-log info block.lcm");
  EXPECT_EQ(outcome.exit_code, kExitLost) << outcome.output;
  EXPECT_THAT(outcome.output,
              AllOf(HasSubstr("block.lcm: 621 events"), HasSubstr("between events 399 and 408")));
}

TEST_F(DamagedLog, ALogThatEndsInTheMiddleOfAnEventSaysSo) {
  const Outcome outcome = Run("pangea-log info cut.lcm");
  EXPECT_EQ(outcome.exit_code, kExitLost) << outcome.output;
  EXPECT_THAT(outcome.output,
              AllOf(HasSubstr("cut.lcm: 628 events"),
                    HasSubstr("cut.lcm: ends in the middle of an event, its last 510 bytes"),
                    Not(HasSubstr("damaged"))));
}

TEST_F(DamagedLog, WhatIsNoLogIsAnError) {
  for (const char* command :
       {"pangea-log info notes.txt", "pangea-log list notes.txt", "pangea-log explain notes.txt",
        "pangea-log diff notes.txt bit.lcm", "pangea-log cut notes.txt --out no.lcm",
        "pangea-log cat notes.txt bit.lcm --out no_2.lcm", "pangea-log export notes.txt --tum no",
        "pangea-session report notes.txt --out no", "pangea-session replay notes.txt --out no_3",
        "pangea-viewer --log notes.txt --port 0",
        "pangea-keyframe-player --agent 1 --keyframes notes.txt --bus memq://"}) {
    const Outcome outcome = Run(std::string("timeout 20 ") + command);
    EXPECT_EQ(outcome.exit_code, 1) << command << "\n" << outcome.output;
    EXPECT_THAT(outcome.output, HasSubstr("notes.txt: is no LCM log")) << command;
  }
}

TEST_F(DamagedLog, EachToolReadsOnBehindTheDamage) {
  // Of 629 events 314 are before the damaged one, so more lines than that come from after it.
  Outcome outcome = Run("pangea-log list bit.lcm > list.txt");
  EXPECT_EQ(outcome.exit_code, kExitLost);
  EXPECT_THAT(outcome.output, HasSubstr(kBit));
  EXPECT_EQ(std::ranges::count(Text("list.txt"), '\n'), kEvents - 1);
  for (const char* command :
       {"pangea-log diff bit.lcm " PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm",
        "pangea-log diff bit.lcm bit.lcm", "pangea-log explain bit.lcm",
        "pangea-log export bit.lcm --tum tum --ply map.ply --g2o graph.g2o",
        "pangea-log import bit.lcm --g2o graph.g2o --out imported.lcm",
        "pangea-log cat cut.lcm bit.lcm --out both.lcm"}) {
    outcome = Run(command);
    EXPECT_EQ(outcome.exit_code, kExitLost) << command << "\n" << outcome.output;
    EXPECT_THAT(outcome.output, HasSubstr(kBit)) << command;
  }
  EXPECT_THAT(outcome.output, HasSubstr("cut.lcm: ends in the middle")) << "cat names both";
  outcome = Run("pangea-log info both.lcm");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr(fmt::format("both.lcm: {} events", 2 * (kEvents - 1))));
  EXPECT_THAT(Text("graph.g2o"), HasSubstr("# 62 is keyframe"));
}

TEST_F(DamagedLog, ACutOfItIsWhole) {
  Outcome outcome = Run("pangea-log cut block.lcm --out mended.lcm");
  EXPECT_EQ(outcome.exit_code, kExitLost) << outcome.output;
  outcome = Run("pangea-log info mended.lcm");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("mended.lcm: 621 events"));
}

TEST_F(DamagedLog, TheReportIsMarked) {
  Outcome outcome = Run("pangea-session report bit.lcm --out report");
  EXPECT_EQ(outcome.exit_code, kExitLost) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr(std::string("pangea-session: ") + kBit));
  EXPECT_THAT(Json("report/report.json")["lost"], ElementsAre(kBit));
  EXPECT_THAT(Text("report/report.md").substr(0, 300), HasSubstr(kBit));
  EXPECT_THAT(Text("report/report.html"), HasSubstr(kBit));
  EXPECT_EQ(Json("report/report.json")["constraints"]["accepted"].get<int>() +
                Json("report/report.json")["constraints"]["refused"].get<int>(),
            64)
      << "one of 65 is lost";
  outcome = Run("pangea-session report " + kSample + " --out report_of_the_whole");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_THAT(Json("report_of_the_whole/report.json")["lost"], ElementsAre());
  EXPECT_THAT(Text("report_of_the_whole/report.md"), Not(HasSubstr("could be read")));
}

TEST_F(DamagedLog, AReplayOfAllKeyframesIsMarked) {
  const Outcome outcome = Run("pangea-session replay bit.lcm --out replay");
  EXPECT_EQ(outcome.exit_code, kExitLost) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("replayed 63 keyframes of 2 agents"));
  EXPECT_THAT(Json("replay/report.json")["lost"], ElementsAre(kBit));
}

TEST_F(DamagedLog, AReplayNamesTheDamageThatTookKeyframes) {
  const Outcome outcome = Run("pangea-session replay block.lcm --out replay_of_block");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.output,
              AllOf(HasSubstr("keyframes are missing"), HasSubstr("keyframes 19 to 19"),
                    HasSubstr("The log is damaged, and they were lost there"),
                    HasSubstr("block.lcm: 1 damaged place")));
}

TEST_F(DamagedLog, EveryCommandOnItsSiteSaysIt) {
  ASSERT_EQ(Run("pangea-site create hall && cp bit.lcm hall/journal.lcm").exit_code, 0);
  for (const char* command : {"info hall", "backup hall copy", "restore copy again",
                              "export hall --out of_hall", "compact hall"}) {
    const Outcome outcome = Run(fmt::format("pangea-site {}", command));
    EXPECT_EQ(outcome.exit_code, kExitLost) << command << ": " << outcome.output;
  }
  EXPECT_EQ(Run("pangea-site info hall").exit_code, 0);
}

TEST_F(DamagedLog, ThePlayerAndTheViewerSayIt) {
  Outcome outcome =
      Run("timeout -s INT 20 pangea-keyframe-player --agent 1 --keyframes bit.lcm --bus memq:// "
          "--duration 1 --rate 10");
  EXPECT_EQ(outcome.exit_code, kExitLost) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr(std::string("pangea-keyframe-player: ") + kBit));
  fs::create_directories(*folder_ / "page");
  Write("page/index.html", "<!doctype html>");
  outcome =
      Run("(timeout --preserve-status -s INT 2 pangea-viewer --log bit.lcm --page page --port 0)");
  EXPECT_EQ(outcome.exit_code, kExitLost) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr(std::string("pangea-viewer: ") + kBit));
}

}  // namespace
}  // namespace pangea::tests

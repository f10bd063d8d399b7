// Tests the options of `replay` for finding a mistake: a part of the log, one process alone, the
// first difference of two runs, the reasons of a constraint.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Replays the sample once for all tests of this file.
class ReplayDebugging : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new fs::path(FreshFolder("replay_debugging"));
    std::istringstream results(RunCommand("pangea-log explain " + kSample).output);
    constraint_ = new std::string;
    results >> *constraint_;
    whole_ = new Outcome(Replay(kSample, "whole", "--explain " + *constraint_));
    ASSERT_EQ(whole_->exit_code, 0) << whole_->output;
  }
  static void TearDownTestSuite() {
    fs::remove_all(*folder_);
    delete folder_;
    delete constraint_;
    delete whole_;
  }
  static std::string Log(const std::string& name) {
    return (*folder_ / name / "session.lcm").string();
  }
  static Outcome Replay(const std::string& log, const std::string& out,
                        const std::string& options = "") {
    return RunCommand("pangea-session replay " + log + " --out " + (*folder_ / out).string() + " " +
                      options);
  }
  static fs::path* folder_;
  static std::string* constraint_;  // an id
  static Outcome* whole_;
};
fs::path* ReplayDebugging::folder_ = nullptr;
std::string* ReplayDebugging::constraint_ = nullptr;
Outcome* ReplayDebugging::whole_ = nullptr;

// From the others' messages in a replay's log, each process repeats its own messages; so do two
// together.
TEST_F(ReplayDebugging, EachProcessAloneRepeatsItself) {
  for (const char* process : {"place_recognition", "inter_map_ba", "fusion", "posegraph",
                              "global_ba", "posegraph,global_ba", "fusion,global_ba"}) {
    const Outcome alone = Replay(Log("whole"), process, std::string("--only ") + process);
    EXPECT_EQ(alone.exit_code, 0) << process << "\n" << alone.output;
    EXPECT_THAT(alone.output, HasSubstr("no message differs"));
  }
}

// Outputs that such a replay cannot give are refused, not left out silently.
TEST_F(ReplayDebugging, OneProcessAloneHasNoReport) {
  for (const char* option : {"--explain 1", "--expect demo", "--recording 1=folder"}) {
    const Outcome outcome = Replay(kSample, "refused", std::string("--only fusion ") + option);
    EXPECT_GT(outcome.exit_code, 100) << outcome.output;
    EXPECT_THAT(outcome.output, HasSubstr(" excludes --"));
  }
}

TEST_F(ReplayDebugging, WhatIsAskedIsCheckedBeforeTheReplay) {
  Outcome outcome = Replay(kSample, "unasked", "--explain 5");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.output, HasSubstr("--explain 5: no match of two keyframes of " + kSample));
  outcome = Replay(kSample, "unasked", "--diff " PANGEA_SOURCE_DIR "/README.md");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.output, HasSubstr("README.md: is no LCM log"));
  EXPECT_FALSE(fs::exists(*folder_ / "unasked"));
  outcome = RunCommand("pangea-log explain " + kSample + " --constraint 5 --recording 1=nowhere");
  EXPECT_THAT(outcome.output, HasSubstr("--recording 1=nowhere: there is no such folder"));
}

TEST_F(ReplayDebugging, APartOfTheLog) {
  const Outcome part = Replay(kSample, "part", "--until 6 --diff " + Log("whole"));
  const Outcome info = RunCommand("pangea-log info " + Log("part"));
  EXPECT_THAT(info.output, HasSubstr("KEYFRAME_1"));
  EXPECT_LT(fs::file_size(Log("part")), fs::file_size(Log("whole")));
  // The partial replay ends with the work that waits for a quiet bus: there it differs from the
  // whole, but not in its verification results.
  EXPECT_EQ(part.exit_code, 2) << part.output;
  EXPECT_THAT(part.output, HasSubstr("they part at"));
  EXPECT_THAT(part.output.substr(part.output.find("they part at")),
              AllOf(Not(HasSubstr("PLACE_MATCH")), Not(HasSubstr("CONSTRAINT"))));
  EXPECT_EQ(Replay(kSample, "none", "--until 0.001").exit_code, 1);
}

TEST_F(ReplayDebugging, WhereTwoLogsPart) {
  const std::string cut = (*folder_ / "cut.lcm").string();
  Outcome outcome = RunCommand("pangea-log diff " + Log("whole") + " " + Log("whole"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  outcome = RunCommand("pangea-log cut " + Log("whole") + " --to 8 --out " + cut +
                       " && pangea-log diff " + Log("whole") + " " + cut);
  EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("the second has no more"));
}

TEST_F(ReplayDebugging, MessagesFieldByField) {
  Outcome outcome = RunCommand("pangea-log list " + Log("whole") + " --channels CONSTRAINT");
  EXPECT_THAT(outcome.output, HasSubstr("  CONSTRAINT  constraint_t  "));
  EXPECT_THAT(outcome.output, Not(HasSubstr("KEYFRAME")));
  outcome = RunCommand("pangea-log list " + Log("whole") + " --channels KEYFRAME_1 --fields");
  EXPECT_THAT(outcome.output,
              AllOf(HasSubstr("    id.seq = 0\n"), HasSubstr("descriptors[7]"),
                    Not(HasSubstr("descriptors[8]")), HasSubstr("further items of arrays")));
}

TEST_F(ReplayDebugging, WhyAConstraintIsAsItIs) {
  EXPECT_THAT(whole_->output, HasSubstr("constraint_" + *constraint_ + ".png"));
  EXPECT_GT(fs::file_size(*folder_ / "whole" / ("constraint_" + *constraint_ + ".png")), 10'000u);
}

}  // namespace
}  // namespace pangea::tests

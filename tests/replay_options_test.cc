// Tests the way of options from the file to the process, then into the capture, and from the
// capture into the replay.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr char kServerPrograms[] =
    "place-recognition inter-map-ba fusion posegraph global-ba anchors";

class ReplayOptions : public ::testing::Test {
 protected:
  void SetUp() override { folder_ = FreshFolder("replay_options"); }
  void TearDown() override { fs::remove_all(folder_); }
  Outcome Replay(const std::string& log, const std::string& out, const std::string& more = "") {
    return RunCommand("pangea-session replay " + log + " --out " + (folder_ / out).string() + " " +
                      more);
  }
  std::string Log(const std::string& run) const { return (folder_ / run / "session.lcm").string(); }
  std::string Write(const std::string& text) const {
    const fs::path file = folder_ / "options.yaml";
    std::ofstream(file) << text;
    return file.string();
  }
  fs::path folder_;
};

TEST_F(ReplayOptions, WhatWasSetIsInTheLogOfTheReplay) {
  const Outcome plain = Replay(kSample, "plain", "--until 6");
  EXPECT_EQ(plain.exit_code, 0) << plain.output;
  EXPECT_THAT(plain.output,
              AllOf(HasSubstr("defaults, as the log has none"), Not(HasSubstr("option fusion"))));
  const std::string file = Write("fusion:\n  alignment: {min_inliers: 70, min_found: 12}\n");
  const Outcome strict = Replay(
      kSample, "strict", "--until 6 --options " + file + " --set fusion.alignment.min_inliers=80");
  EXPECT_EQ(strict.exit_code, 0) << strict.output;
  EXPECT_THAT(strict.output,
              AllOf(HasSubstr("option fusion.alignment.min_found 12 (default 10)"),
                    HasSubstr("option fusion.alignment.min_inliers 80 (default 16)")));
  const Outcome differs = RunCommand("pangea-log diff " + Log("plain") + " " + Log("strict"));
  EXPECT_EQ(differs.exit_code, 2) << differs.output;

  const Outcome again = Replay(Log("strict"), "again", "--diff " + Log("strict"));
  EXPECT_EQ(again.exit_code, 0) << again.output;
  EXPECT_THAT(again.output,
              AllOf(HasSubstr("option fusion.alignment.min_inliers 80 (default 16)"),
                    HasSubstr("no message differs"), Not(HasSubstr("the log has none"))));

  std::istringstream results(RunCommand("pangea-log explain " + Log("strict")).output);
  std::string constraint;
  results >> constraint;
  const Outcome why =
      RunCommand("pangea-log explain " + Log("strict") + " --constraint " + constraint);
  EXPECT_THAT(why.output, HasSubstr("options of the log: fusion.alignment.min_inliers 80"));

  const Outcome table = RunCommand("pangea-session compare " + (folder_ / "plain").string() + " " +
                                   (folder_ / "strict").string());
  EXPECT_EQ(table.exit_code, 0) << table.output;
  EXPECT_THAT(table.output, AllOf(HasSubstr("NEES"),
                                  HasSubstr("strict: option fusion.alignment.min_inliers 80")));
}

TEST_F(ReplayOptions, WhatMakesNoSenseIsRefused) {
  const Outcome unknown = Replay(kSample, "none", "--set fusion.alignment.min_inlier=20");
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_THAT(unknown.output, HasSubstr("did you mean 'fusion.alignment.min_inliers'?"));
  const Outcome zero =
      Replay(kSample, "none", "--options " + Write("fusion:\n  alignment:\n    min_inliers: 0\n"));
  EXPECT_EQ(zero.exit_code, 1);
  EXPECT_THAT(zero.output,
              HasSubstr("options.yaml:3: key 'fusion.alignment.min_inliers' must be a whole "
                        "number from 4 to 100000, not '0'"));
  EXPECT_FALSE(fs::exists(folder_ / "none"));
}

TEST_F(ReplayOptions, EveryProcessPrintsWhatIsInForce) {
  std::istringstream programs(std::string(kServerPrograms) + " agent-handler uplink link-emulator");
  for (std::string name; programs >> name;) {
    const Outcome defaults = RunCommand("pangea-" + name + " --print-options");
    EXPECT_EQ(defaults.exit_code, 0) << defaults.output;
    EXPECT_THAT(defaults.output, HasSubstr("  # ")) << name;
    const Outcome back =
        RunCommand("pangea-" + name + " --print-options --options " + Write(defaults.output));
    EXPECT_EQ(back.output, defaults.output) << name;
  }
  EXPECT_EQ(RunCommand("pangea-map-points --print-options").output, "# no options\n");
  EXPECT_EQ(
      RunCommand("pangea-map-points --print-options --options " + Write("# no options\n")).output,
      "# no options\n");
  const std::string file = Write("alignment: {min_inliers: 33}\n");
  EXPECT_THAT(RunCommand("pangea-fusion --options " + file + " --print-options").output,
              HasSubstr("  min_inliers: 33  # 4 to 100000: distinct landmarks\n"));
  EXPECT_THAT(RunCommand("pangea-place-recognition --options " + Write("max_keyframes: 7\n") +
                         " --print-options")
                  .output,
              HasSubstr("max_keyframes: 7"));
  EXPECT_THAT(
      RunCommand("pangea-vio --options " + Write("estimator: {window: 9}\n") + " --print-options")
          .output,
      HasSubstr("  window: 9  # "));
}

}  // namespace
}  // namespace pangea::tests

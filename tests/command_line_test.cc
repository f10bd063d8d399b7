// Tests the programs as a shell sees them: completion, the list of sessions, wrong arguments.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsSupersetOf;
using testing::Not;

// The completions that bash offers after these words; the last one, perhaps empty, is being typed.
std::vector<std::string> Complete(const std::vector<std::string>& words) {
  std::string quoted;
  for (const std::string& word : words) {
    quoted += " \"" + word + "\"";
  }
  const size_t n = words.size();
  const Outcome outcome = RunCommand(
      "cd " PANGEA_SOURCE_DIR " && bash -c '. scripts/completion/pangea.bash && COMP_WORDS=(" +
      quoted + ") && COMP_CWORD=" + std::to_string(n - 1) + " && _pangea \"" + words.front() +
      "\" \"" + words.back() + "\" \"" + words[n - 2] +
      "\" && { [ ${#COMPREPLY[@]} -eq 0 ] || printf \"%s\\n\" \"${COMPREPLY[@]}\"; }'");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  std::vector<std::string> replies;
  std::istringstream lines(outcome.output);
  for (std::string line; std::getline(lines, line);) {
    replies.push_back(line);
  }
  return replies;
}

TEST(Completion, OffersSubCommands) {
  EXPECT_THAT(Complete({"pangea-session", ""}), IsSupersetOf({"run", "list", "replay", "report"}));
  EXPECT_THAT(Complete({"pangea-session", "li"}), ElementsAre("list"));
  EXPECT_THAT(Complete({"pangea-log", "e"}), IsSupersetOf({"explain", "export"}));
}

TEST(Completion, OffersTheOptionsOfTheSubCommand) {
  const auto options = Complete({"pangea-session", "run", "--"});
  EXPECT_THAT(options, IsSupersetOf({"--out", "--rate", "--recordings"}));
  EXPECT_THAT(options, Not(Contains("--expect")));
  EXPECT_THAT(Complete({"pangea-session", "report", "--ex"}), ElementsAre("--expect"));
  EXPECT_THAT(Complete({"pangea-uplink", "--li"}), ElementsAre("--link"));
}

TEST(Completion, OffersSessionsAndTheirFiles) {
  EXPECT_THAT(Complete({"pangea-session", "run", "dem"}), ElementsAre("demo"));
  EXPECT_THAT(Complete({"pangea-session", "run", "sessions/dem"}),
              ElementsAre("sessions/demo.yaml"));
  EXPECT_THAT(Complete({"pangea-session", "run", "--rate", ""}), Contains("max"));
  // For anything else bash completes file names itself.
  EXPECT_THAT(Complete({"pangea-session", "report", "logs/"}), ElementsAre());
  EXPECT_THAT(Complete({"pangea-session", "run", "--out", ""}), ElementsAre());
}

TEST(SessionList, ShowsTheSessionsAtHand) {
  Outcome outcome = RunCommand("cd " PANGEA_SOURCE_DIR " && pangea-session list");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.output, HasSubstr("sessions/demo.yaml: Two agents walk"));
  EXPECT_THAT(outcome.output, HasSubstr("agent 2: walk_2, after 3 s"));
  EXPECT_THAT(outcome.output, HasSubstr("missing: agent 1: recording "));
  outcome = RunCommand("pangea-session list " PANGEA_SOURCE_DIR "/sessions --names");
  EXPECT_THAT(outcome.output, HasSubstr("demo\ntable2_MH_01\n"));
  outcome = RunCommand("pangea-session list " PANGEA_SOURCE_DIR "/sessions/demo.yaml --names");
  EXPECT_EQ(outcome.output, "demo\n");
}

TEST(Log, ASessionsFolderStandsForItsLog) {
  const fs::path folder = FreshFolder("report_of_a_folder");
  Outcome outcome = RunCommand("pangea-session report " PANGEA_SOURCE_DIR "/logs/two_walks --out " +
                               (folder / "out").string());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_TRUE(fs::exists(folder / "out" / "report.json"));
  outcome = RunCommand("pangea-session report " + folder.string());
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_THAT(outcome.output, HasSubstr("session.lcm"));
}

// An installed program without a folder of sessions nearby uses the installed ones.
TEST(SessionList, FindsTheInstalledSessions) {
  const fs::path folder = FreshFolder("installed_sessions");
  fs::create_directories(folder / "bin");
  fs::create_directories(folder / "share" / "pangea");
  fs::copy(PANGEA_BINARY_DIR "/bin/pangea-session", folder / "bin" / "pangea-session");
  const std::string list = "cd " + folder.string() + " && bin/pangea-session ";
  Outcome outcome = RunCommand(list + "list");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.output, HasSubstr("sessions: no session files here"));
  fs::copy(PANGEA_SOURCE_DIR "/sessions", folder / "share" / "pangea" / "sessions");
  outcome = RunCommand(list + "list --names");
  EXPECT_THAT(outcome.output, HasSubstr("demo\ntable2_MH_01\n"));
  outcome = RunCommand(list + "run demoo --out out");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.output, HasSubstr("did you mean 'demo'?"));
  fs::remove_all(folder);
}

TEST(Log, WhatIsNoLogIsNoEmptyLog) {
  for (const char* command : {"info", "explain", "export --tum out"}) {
    const Outcome outcome =
        RunCommand(fmt::format("pangea-log {} " PANGEA_SOURCE_DIR "/README.md", command));
    EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
    EXPECT_THAT(outcome.output, HasSubstr("README.md: is no LCM log"));
  }
  const fs::path empty = FreshFolder("empty_log") / "empty.lcm";
  std::ofstream(empty).flush();
  const Outcome outcome = RunCommand("pangea-log info " + empty.string());
  EXPECT_GT(outcome.exit_code, 100) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("empty.lcm: is empty"));
  const Outcome pipe = RunCommand("cat " + kSample + " | pangea-log info /dev/stdin");
  EXPECT_EQ(pipe.exit_code, 1);
  EXPECT_THAT(pipe.output, HasSubstr("pangea-log: /dev/stdin: "));
  const Outcome cost = RunCommand("pangea-log cost " + empty.string());
  EXPECT_EQ(cost.exit_code, 1);
  EXPECT_THAT(cost.output, HasSubstr("empty.lcm: has no VERTEX_SE3:QUAT"));
}

// The output may be the result that the user needs, so its loss is an error.
TEST(Log, WhatIsReadIsNotOverwritten) {
  const fs::path log = FreshFolder("overwrite") / "session.lcm";
  fs::copy_file(kSample, log);
  const std::string name = log.string();
  for (const std::string& command :
       {"export " + name + " --g2o " + name, "export " + name + " --ply " + name,
        "explain " + name + " --constraint 1 --out " + name}) {
    const Outcome outcome = RunCommand("pangea-log " + command);
    EXPECT_EQ(outcome.exit_code, 1) << command;
    EXPECT_THAT(outcome.output, HasSubstr("is the log that is read")) << command;
    EXPECT_EQ(fs::file_size(log), fs::file_size(kSample)) << command;
  }
}

TEST(Output, AFullDiskIsSaid) {
  const std::string log = PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm";
  for (const std::string& command : {"pangea-log info " + log, "pangea-log list --json " + log}) {
    const Outcome outcome = RunCommand(command + " >/dev/full");
    EXPECT_EQ(outcome.exit_code, 1) << command;
    EXPECT_THAT(outcome.output, HasSubstr("pangea-log: the output cannot be written")) << command;
  }
  for (const char* program : {"pangea-uplink", "pangea-agent-handler", "pangea-fusion"}) {
    const Outcome outcome = RunCommand(fmt::format("{} --print-options >/dev/full", program));
    EXPECT_EQ(outcome.exit_code, 1) << program;
    EXPECT_THAT(outcome.output, HasSubstr("the output cannot be written")) << program;
  }
}

TEST(Numbers, AreFinite) {
  for (const char* command : {"vio --start nan", "vio --duration 0", "sim --static-start -5",
                              "calibrate --duration inf", "log list --from nan"}) {
    const Outcome outcome = RunCommand(fmt::format("pangea-{}", command));
    EXPECT_GT(outcome.exit_code, 100) << command;
    EXPECT_THAT(outcome.output, HasSubstr("is no finite number")) << command;
  }
}

// `explain` and a replay need them to find images and ground truth.
TEST(Log, WhatIsMadeOfALogKeepsItsRecordings) {
  const fs::path folder = FreshFolder("log_recordings");
  const std::string whole = (folder / "whole" / "session.lcm").string();
  fs::create_directories(folder / "whole");
  fs::copy(PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm", whole);
  std::ofstream(folder / "whole" / "recordings.json")
      << R"({"agents": [{"id": 2, "recording": "/walk_2", "start": 1.5, "duration": 0}],
             "expect": {"groups": 1}})";
  const std::string part = (folder / "part.lcm").string();
  const std::string parts = (folder / "parts.lcm").string();
  ASSERT_EQ(RunCommand("pangea-log cut " + whole + " --to 4 --out " + part).exit_code, 0);
  ASSERT_EQ(RunCommand("pangea-log cat " + part + " --out " + parts).exit_code, 0);
  for (const std::string& log : {part, parts}) {
    const auto record = ReadJson(log + ".recordings.json");
    ASSERT_EQ(record["agents"].size(), 1U) << log;
    EXPECT_EQ(record["agents"][0]["id"], 2);
    EXPECT_EQ(record["agents"][0]["recording"], "/walk_2");
    EXPECT_EQ(record["agents"][0]["start"], 1.5);
    EXPECT_TRUE(record["expect"].empty()) << "of the whole, not of a part";
  }
  // A log without recordings that replaces one of the same name must not inherit the other's.
  fs::remove(part);
  ASSERT_EQ(
      RunCommand("pangea-log cut " PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm --to 4 --out " +
                 part)
          .exit_code,
      0);
  EXPECT_FALSE(fs::exists(part + ".recordings.json"));
  fs::remove_all(folder);
}

// `--rate` is the speed of playing, in every program that has it.
TEST(Uplink, BandwidthAndBudgetHaveOneUnit) {
  EXPECT_THAT(Complete({"pangea-uplink", "--b"}), ElementsAre("--bus", "--bandwidth", "--budget"));
  EXPECT_THAT(Complete({"pangea-uplink", "--ra"}), ElementsAre());
  Outcome outcome = RunCommand("pangea-uplink --agent 1 --key none --bandwidth 0.5");
  EXPECT_THAT(outcome.output, HasSubstr("the bandwidth must be at least 1 kB/s"));
  outcome = RunCommand("pangea-uplink --agent 1 --key none --budget 4");
  EXPECT_THAT(outcome.output, HasSubstr("the budget must be at least 5 kB/s"));
}

// Otherwise each sent packet would also be received on the same side.
TEST(Link, ItsTwoSidesDiffer) {
  for (const char* command :
       {"pangea-link-emulator --agent 1 --bus x --agent-link u --server-link u",
        "pangea-uplink --agent 1 --key none --bus u --link u",
        "pangea-server --journal none --keys none --bus u --link u",
        "pangea-agent-handler --journal none --keys none --bus u --link u"}) {
    const Outcome outcome = RunCommand(fmt::format("timeout 10 {}", command));
    EXPECT_EQ(outcome.exit_code, 1) << command;
    EXPECT_THAT(outcome.output, HasSubstr("are both u: give two LCM URLs that differ")) << command;
  }
}

TEST(Server, ItsBusesAreCheckedBeforeAProcessStarts) {
  for (const char* urls : {"--bus udp://239.255.76.67:7667", "--link udpm://10.0.0.1:7668"}) {
    const Outcome outcome =
        RunCommand(fmt::format("timeout 10 pangea-server --journal none --keys none {}", urls));
    EXPECT_EQ(outcome.exit_code, 1) << urls;
    EXPECT_THAT(outcome.output, HasSubstr("give udpm://GROUP:PORT")) << urls;
    EXPECT_THAT(outcome.output, Not(HasSubstr("started"))) << urls;
  }
}

// Otherwise the report would lack ground truth, as if the recording had none.
TEST(Session, ARecordingThatIsGivenIsThere) {
  const Outcome outcome =
      RunCommand("pangea-session replay " PANGEA_SOURCE_DIR
                 "/logs/two_walks/session.lcm --out nowhere/out --recording 1=nowhere");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("--recording 1=nowhere: there is no such folder"));
}

TEST(Vio, FindsARecordingByItsNameAsASessionDoes) {
  const fs::path folder = FreshFolder("vio_recording");
  fs::create_directories(folder / "MH_01_easy" / "mav0");
  const Outcome outcome =
      RunCommand("cd " + folder.string() + " && pangea-vio --agent 1 --bus none --recording MH_01");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.output, testing::StartsWith("pangea-vio: plays ./MH_01_easy\n"));
}

TEST(Eval, StretchesHaveALength) {
  for (const char* option : {"--distances 1,0", "--durations -1", "--max-gap 0"}) {
    const Outcome outcome = RunCommand(std::string("pangea-eval rpe a.tum b.tum ") + option);
    EXPECT_GT(outcome.exit_code, 100) << outcome.output;
    EXPECT_THAT(outcome.output, HasSubstr("is no number"));
  }
}

TEST(Eval, TheHelpNamesBothFiles) {
  for (const char* command : {"ate", "rpe"}) {
    const Outcome outcome = RunCommand(fmt::format("pangea-eval {} --help", command));
    EXPECT_THAT(outcome.output, testing::ContainsRegex("Usage:.* ESTIMATE REFERENCE"));
  }
}

TEST(Eval, TheEstimateComesFirst) {
  const Outcome outcome = RunCommand("pangea-eval ate " PANGEA_SOURCE_DIR "/logs a.tum");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("is a folder: give ESTIMATE first, then REFERENCE"));
}

TEST(Errors, OfAFolderThatCannotBeUsedBeginWithItsPath) {
  const std::string too_long(300, 'x');
  const Outcome outcome = RunCommand(
      "pangea-session report " PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm --out " + too_long);
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.output,
            "pangea-session: " + too_long + "/session.lcm: cannot be used: File name too long\n");
}

TEST(Keygen, MakesTheFolderForItsOwnerAlone) {
  const fs::path folder = FreshFolder("keygen");
  const fs::path key = folder / "site" / "keys" / "agent_4.key";
  const Outcome outcome = RunCommand("pangea-agent-handler keygen --agent 4 --out " + key.string());
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_TRUE(fs::is_regular_file(key));
  EXPECT_EQ(fs::status(key.parent_path()).permissions(), fs::perms::owner_all);
}

// No server answers on this link; the player, which would wait 20 s for one, is told to end.
TEST(Uplink, SaysAtItsEndWhatIsLostWithoutASpool) {
  const Outcome outcome = RunCommand(
      "(rm -rf lost && pangea-agent-handler keygen --agent 1 --out lost/key "
      "&& "
      "timeout -s INT 9 pangea-uplink --agent 1 --key lost/key --bus 'udpm://239.255.76.67:20013' "
      "--link 'udpm://239.255.76.68:20014' & sleep 2 && "
      "timeout -s INT 4 pangea-keyframe-player --agent 1 --bus 'udpm://239.255.76.67:20013' "
      "--keyframes " PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm --rate 20; wait)");
  EXPECT_THAT(outcome.output,
              HasSubstr("keyframes: 0 acknowledged, 32 lost: --spool FOLDER keeps them"));
}

}  // namespace
}  // namespace pangea::tests

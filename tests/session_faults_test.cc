// Tests the faults of a session file: a server process is killed, an agent is disconnected and
// returns, and the map is as expected.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "programs.h"
#include "recording/trajectory.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST(SessionFaults, ACutOffAgentAndAKilledProcessCostNothing) {
  const fs::path folder = FreshFolder("session_faults");
  const fs::path sample = fs::path(PANGEA_SOURCE_DIR) / "logs" / "two_walks";
  const std::string keyframes = "keyframes: " + (sample / "session.lcm").string();
  const fs::path file = WriteSession(folder, {"id: 1, " + keyframes, "id: 2, " + keyframes});
  std::ofstream(file, std::ios::app) << "faults:\n"
                                        "  - {at: 3, disconnect: 2, seconds: 12}\n"
                                        "  - {at: 6, kill: fusion}\n"
                                        "expect: {groups: 1, maps: 1}\n";
  const fs::path out = folder / "out";
  const Outcome run =
      RunCommand("pangea-session run " + file.string() + " --out " + out.string() + " --rate 6");
  EXPECT_EQ(run.exit_code, 0) << run.output;
  EXPECT_THAT(run.output, HasSubstr("cut at 0.5 s for 2 s"));
  const auto report = ReadJson(out / "report.json");
  ASSERT_EQ(report["agents"].size(), 2u) << run.output;
  EXPECT_TRUE(report["agents"][0]["link"].is_null());
  EXPECT_GT(report["agents"][1]["link"]["packets_up"]["cut"].get<int>(), 5);
  EXPECT_EQ(report["processes"]["fusion"]["restarts"], 1);
  for (const char* name : {"agent_1.tum", "agent_2.tum"}) {
    EXPECT_EQ(ReadTum((out / name).string(), nullptr).size(),
              ReadTum((sample / "expected" / name).string(), nullptr).size());
  }
  fs::remove_all(folder);
}

// At rate max there is no session time after the last recording.
TEST(SessionFaults, AFaultAfterTheRecordingsDoesNotHappenAtRateMax) {
  const fs::path folder = FreshFolder("session_late_fault");
  const std::string keyframes = "keyframes: " PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm";
  const fs::path file = WriteSession(folder, {"id: 1, " + keyframes});
  std::ofstream(file, std::ios::app) << "faults:\n  - {at: 2, kill: fusion}\n"
                                        "  - {at: 500, kill: posegraph}\n";
  const fs::path out = folder / "out";
  const Outcome run =
      RunCommand("pangea-session run " + file.string() + " --out " + out.string() + " --rate max");
  EXPECT_EQ(run.exit_code, 0) << run.output;
  const std::string said = "the fault 'kill posegraph at 500 s' did not happen";
  EXPECT_THAT(run.output, HasSubstr(said));
  const auto report = ReadJson(out / "report.json");
  EXPECT_EQ(report["processes"]["fusion"]["restarts"], 1);
  EXPECT_FALSE(report["processes"]["posegraph"].contains("restarts"));
  EXPECT_THAT(report["notes"], testing::Contains(HasSubstr(said)));
  fs::remove_all(folder);
}

// As on a full disk: no file grows beyond 300 kB. The server can never write the rest. The players
// would wait 20 s for it, so they are told to end.
TEST(SessionFaults, AFullDiskIsSaidAndCtrlCEndsTheWaiting) {
  const fs::path folder = FreshFolder("session_full_disk");
  const std::string keyframes = "keyframes: " PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm";
  const fs::path file = WriteSession(folder, {"id: 1, " + keyframes, "id: 2, " + keyframes});
  const std::string said = (folder / "said.txt").string();
  const Outcome run = RunCommand(
      "trap '' XFSZ; ulimit -f $((300 * 1024 / 512)); pangea-session run " + file.string() +
      " --rate max --out " + (folder / "out").string() + " >" + said +
      " 2>&1 & session=$!; "
      "players() { for child in $(cat /proc/$session/task/*/children); do"
      " ! grep -q keyframe /proc/$child/comm || echo $child; done; }; "
      "for i in $(seq 400); do grep -q 'agent_handler: THE DISK REFUSES WRITES' " +
      said +
      " && break; sleep 0.1; done; "
      "for i in $(seq 400); do left=$(players); test -n \"$left\" || break; kill -INT $left; "
      "sleep 0.1; done; sleep 1; "
      "kill -INT $session; for i in $(seq 150); do kill -0 $session || break; sleep 0.1; done; "
      "kill -9 $session && echo IT GOES ON; wait $session");
  EXPECT_EQ(run.exit_code, 1) << run.output;
  EXPECT_THAT(run.output, testing::Not(HasSubstr("IT GOES ON")));
  EXPECT_THAT(ReadFile(said),
              testing::AllOf(HasSubstr("agent_handler: THE DISK REFUSES WRITES: make room in"),
                             HasSubstr("the server had not worked off what had come")));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace pangea::tests

// What a session file does to its processes on purpose: a server process is killed, an agent is cut
// off and comes back, and the map is what was expected.

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

}  // namespace
}  // namespace pangea::tests

// Tests that a captured session replays to a known map, also after changes of the code.

#include <gtest/gtest.h>

#include "programs.h"
#include "recording/trajectory.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;

TEST(ReplayGolden, TwoWalks) {
  const fs::path sample = fs::path(PANGEA_SOURCE_DIR) / "logs" / "two_walks";
  const fs::path out = FreshFolder("golden") / "out";
  const Outcome replay = RunCommand("pangea-session replay " + (sample / "session.lcm").string() +
                                    " --out " + out.string());
  ASSERT_EQ(replay.exit_code, 0) << replay.output;
  const auto report = ReadJson(out / "report.json");
  ASSERT_EQ(report["groups"].size(), 1u) << replay.output;
  EXPECT_EQ(report["groups"][0]["agents"], nlohmann::json({1, 2}));
  for (const char* name : {"agent_1.tum", "agent_2.tum"}) {
    const Trajectory got = ReadTum((out / name).string(), nullptr);
    const Trajectory expected = ReadTum((sample / "expected" / name).string(), nullptr);
    ASSERT_EQ(got.size(), expected.size());
    for (size_t i = 0; i < got.size(); ++i) {
      EXPECT_EQ(got[i].utime, expected[i].utime);
      EXPECT_LT((got[i].T.t - expected[i].T.t).norm(), kTolerance_m) << name << " pose " << i;
    }
  }
}

}  // namespace
}  // namespace pangea::tests

// Tests captured keyframes through real processes over bad links: nothing is lost, and the map is
// the same as without any link.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "programs.h"
#include "recording/trajectory.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr double kPlayed_s = 9;  // enough packets to lose

fs::path Sample() { return fs::path(PANGEA_SOURCE_DIR) / "logs" / "two_walks"; }

// Keyframes of an agent in the part that is played.
size_t NumPlayed(const std::string& tum) {
  const Trajectory all = ReadTum((Sample() / "expected" / tum).string(), nullptr);
  const auto in_part = [&](const StampedPose& pose) {
    return 1e-6 * static_cast<double>(pose.utime - all.front().utime) <= kPlayed_s;
  };
  return static_cast<size_t>(std::ranges::count_if(all, in_part));
}

// The contents of a log's OPTIONS_*.
std::string Options(const fs::path& log) {
  return RunCommand("pangea-log list " + log.string() + " --fields --channels 'OPTIONS_.*'").output;
}

TEST(BadLink, ChangesNothing) {
  const fs::path folder = FreshFolder("bad_link");
  const std::string rest =
      "keyframes: " + (Sample() / "session.lcm").string() +
      fmt::format(", duration: {}", kPlayed_s) +
      ", link: {loss: 0.1, delay_ms: 300, jitter_ms: 20, reorder: 0.04, duplicate: 0.04";
  const fs::path file = WriteSession(folder, {"id: 1, uplink: {packet_bytes: 1100}, " + rest + "}",
                                              "id: 2, delay: 2, " + rest + ", seed: 2}"});
  std::ofstream(file, std::ios::app) << "options: {agent_handler: {cache_bytes: 300000}}\n";
  const fs::path out = folder / "out";
  const Outcome run =
      RunCommand("pangea-session run " + file.string() + " --out " + out.string() + " --rate max");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const auto report = ReadJson(out / "report.json");
  ASSERT_EQ(report["groups"].size(), 1u) << run.output;
  EXPECT_EQ(report["groups"][0]["agents"], nlohmann::json({1, 2}));
  for (const char* name : {"agent_1.tum", "agent_2.tum"}) {
    EXPECT_EQ(ReadTum((out / name).string(), nullptr).size(), NumPlayed(name));
  }
  const fs::path replayed = folder / "replayed";
  const Outcome replay = RunCommand("pangea-session replay " + (out / "session.lcm").string() +
                                    " --out " + replayed.string());
  ASSERT_EQ(replay.exit_code, 0) << replay.output;
  EXPECT_LT(Distance_m(out / "agent_1.tum", replayed / "agent_1.tum"), kTolerance_m);
  EXPECT_LT(Distance_m(out / "agent_2.tum", replayed / "agent_2.tum"), kTolerance_m);
  ASSERT_EQ(report["agents"].size(), 2u);
  for (const auto& agent : report["agents"]) {
    const auto& up = agent["link"]["packets_up"];
    EXPECT_GT(up["lost"].get<int>(), 20);
    EXPECT_GT(up["doubled"].get<int>(), 2);
    EXPECT_GT(up["reordered"].get<int>(), 2);
  }
  EXPECT_THAT(run.output, HasSubstr("loss 10 %"));
  // The logs contain the options with which the link's processes ran.
  EXPECT_THAT(Options(out / "agent_1.lcm"),
              AllOf(HasSubstr("packet_bytes: 1100"), HasSubstr("loss: 0.1")));
  EXPECT_THAT(Options(out / "agent_2.lcm"),
              AllOf(HasSubstr("packet_bytes: "), Not(HasSubstr("packet_bytes: 1100"))));
  EXPECT_THAT(Options(out / "session.lcm"), HasSubstr("cache_bytes: 300000"));
  fs::remove_all(folder);
}

}  // namespace
}  // namespace pangea::tests

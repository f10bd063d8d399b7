// Tests that the map does not depend on whose keyframes come first.

#include <gtest/gtest.h>

#include "eval/metrics.h"
#include "log_file/log_writer.h"
#include "programs.h"
#include "recording/trajectory.h"
#include "replay/keyframe_log.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;

// A log with all keyframes of the first agent, then all of the second.
void WriteLog(const fs::path& path, const std::vector<int32_t>& agents) {
  LogFileWriter log(path.string());
  int64_t utime = 0;
  for (const int32_t agent : agents) {
    for (const LoggedKeyframe& keyframe : ReadKeyframeLogOf(
             fs::path(PANGEA_SOURCE_DIR) / "logs" / "two_walks" / "session.lcm", agent)) {
      log.Write(utime++, keyframe.channel, keyframe.data);
    }
  }
}

TEST(ArrivalOrder, OneMap) {
  const fs::path folder = FreshFolder("arrival_order");
  const std::vector<fs::path> outs = {folder / "first", folder / "second"};
  WriteLog(folder / "12.lcm", {1, 2});
  WriteLog(folder / "21.lcm", {2, 1});
  for (size_t i = 0; i < outs.size(); ++i) {
    const fs::path log = folder / (i == 0 ? "12.lcm" : "21.lcm");
    const Outcome replay =
        RunCommand("pangea-session replay " + log.string() + " --out " + outs[i].string());
    ASSERT_EQ(replay.exit_code, 0) << replay.output;
    const auto report = ReadJson(outs[i] / "report.json");
    ASSERT_EQ(report["groups"].size(), 1u) << replay.output;
    const auto& constraints = report["constraints"];
    EXPECT_GE(
        constraints["accepted"].get<int>() + constraints["refused_by_reason"].value("redundant", 0),
        30);
  }
  // The map frames of both replays are those of different agents, so one rotation and translation
  // of all keyframes is free.
  std::vector<std::vector<PosePair>> agents;
  for (const char* name : {"agent_1.tum", "agent_2.tum"}) {
    agents.push_back(Associate(ReadTum((outs[0] / name).string(), nullptr),
                               ReadTum((outs[1] / name).string(), nullptr), 2'000'000));
  }
  const auto joint = JointAbsoluteError(agents, TrajectoryAlignmentKind::kSe3);
  ASSERT_TRUE(joint);
  EXPECT_EQ(joint->position_m.count, 63u);
  EXPECT_LT(joint->position_m.rmse, 0.01);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace pangea::tests

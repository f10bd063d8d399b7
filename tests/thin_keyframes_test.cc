// Tests that the keyframes which an uplink under a budget sends still give one map.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "link/wire.h"
#include "log_file/log_writer.h"
#include "messages/encoding.h"
#include "programs.h"
#include "recording/trajectory.h"
#include "replay/keyframe_log.h"
#include "uplink/thin.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;

// Of the sample's keyframes every fourth is Bare, the others keep few untracked corners.
void WriteThinLog(const fs::path& path) {
  LogFileWriter log(path.string());
  int64_t utime = 0;
  for (const LoggedKeyframe& logged :
       ReadKeyframeLog(fs::path(PANGEA_SOURCE_DIR) / "logs" / "two_walks" / "session.lcm")) {
    KeyframeMessage message{};
    ASSERT_TRUE(DecodeMessage(logged.data, &message));
    const Keyframe keyframe = *Parse(message).value;
    const std::vector<uint8_t> bytes = EncodeMessage(
        ToMessage(keyframe.id.seq % 4 == 3 ? Bare(keyframe) : Thinned(keyframe, 150)));
    log.Write(utime++, logged.channel, bytes);
  }
}

TEST(ThinKeyframes, MakeOneMap) {
  const fs::path folder = FreshFolder("thin_keyframes");
  WriteThinLog(folder / "thin.lcm");
  const fs::path out = folder / "out";
  const Outcome replay = RunCommand("pangea-session replay " + (folder / "thin.lcm").string() +
                                    " --out " + out.string());
  ASSERT_EQ(replay.exit_code, 0) << replay.output;
  const auto report = ReadJson(out / "report.json");
  ASSERT_EQ(report["groups"].size(), 1u) << replay.output;
  EXPECT_EQ(report["groups"][0]["agents"], nlohmann::json({1, 2}));
  // Every keyframe has a pose, near the one that complete keyframes give.
  const fs::path expected = fs::path(PANGEA_SOURCE_DIR) / "logs" / "two_walks" / "expected";
  for (const char* name : {"agent_1.tum", "agent_2.tum"}) {
    EXPECT_LT(Distance_m(out / name, expected / name), 0.05) << name;
  }
  fs::remove_all(folder);
}

}  // namespace
}  // namespace pangea::tests

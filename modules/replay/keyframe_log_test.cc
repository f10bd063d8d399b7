#include "replay/keyframe_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "core/testing/test_cameras.h"
#include "log_file/log_writer.h"
#include "messages/encoding.h"
#include "messages/keyframe_message.h"
#include "messages/messages.h"

namespace pangea {
namespace {

using testing::HasSubstr;

struct Captured {
  int32_t agent = 0;
  int32_t seq = 0;
  int64_t utime = 0;  // sensor clock
  int64_t captured_utime = 0;
  bool damaged = false;
};

std::filesystem::path WriteLog(const std::string& name, const std::vector<Captured>& keyframes) {
  std::filesystem::path path = std::filesystem::path(testing::TempDir()) / name;
  std::filesystem::remove(path);
  LogFileWriter file(path.string());
  for (const Captured& keyframe : keyframes) {
    Keyframe whole;
    whole.id = {{keyframe.agent, 100}, keyframe.seq};
    whole.utime = keyframe.utime;
    whole.camera = EurocTestCamera();
    KeyframeMessage message = ToMessage(whole);
    if (keyframe.damaged) {
      message.camera.T_body_cam.rotation.w = 5;
    }
    file.Write(keyframe.captured_utime, "KEYFRAME_" + std::to_string(keyframe.agent),
               EncodeMessage(message));
  }
  return path;
}

// A log of keyframes of one map: (seq, utime).
std::filesystem::path WriteLog(const std::string& name, int32_t agent,
                               const std::vector<std::pair<int32_t, int64_t>>& keyframes) {
  std::vector<Captured> captured;
  for (const auto& [seq, utime] : keyframes) {
    captured.push_back({agent, seq, utime, utime});
  }
  return WriteLog(name, captured);
}

std::string ErrorOf(const std::filesystem::path& log) {
  try {
    ReadKeyframeLog(log);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no error";
}

TEST(KeyframeLog, RepeatsCountOnce) {
  const auto keyframes =
      ReadKeyframeLog(WriteLog("repeats.lcm", 1, {{0, 10}, {1, 20}, {1, 20}, {2, 30}}));
  ASSERT_EQ(keyframes.size(), 3u);
  EXPECT_EQ(keyframes[2].id.seq, 2);
  EXPECT_EQ(keyframes[2].utime, 30);
}

// Capture times may step back by a little in a log; the time since its beginning does not.
TEST(KeyframeLog, ElapsedTimeIsThatOfTheCapture) {
  const auto keyframes = Interleave({ReadKeyframeLog(
      WriteLog("elapsed.lcm", 1, {{0, 1'000'010}, {1, 1'000'030}, {2, 1'000'020}}))});
  ASSERT_EQ(keyframes.size(), 3u);
  EXPECT_EQ(keyframes[1].elapsed_us, 20);
  EXPECT_EQ(keyframes[2].elapsed_us, 20);
  EXPECT_EQ(keyframes[2].utime, 1'000'020);
}

TEST(KeyframeLog, OfOneAgent) {
  const auto log = WriteLog("one_agent.lcm", 3, {{0, 10}, {1, 20}});
  EXPECT_EQ(ReadKeyframeLogOf(log, 3).size(), 2u);
  EXPECT_THROW(ReadKeyframeLogOf(log, 4), std::runtime_error);
}

TEST(KeyframeLog, NamesGaps) {
  EXPECT_THAT(ErrorOf(WriteLog("gap.lcm", 3, {{0, 10}, {4, 20}})),
              testing::AllOf(HasSubstr("gap.lcm"), HasSubstr("3/100"), HasSubstr("1 to 3")));
}

// Its bytes are those of a keyframe, but not its values: every process ignores it.
TEST(KeyframeLog, ARefusedKeyframeIsMissing) {
  EXPECT_THAT(
      ErrorOf(WriteLog("refused.lcm", {{3, 0, 10, 10}, {3, 1, 20, 20, true}, {3, 2, 30, 30}})),
      testing::AllOf(HasSubstr("keyframes 1 to 1"), HasSubstr("event 1 on KEYFRAME_3"),
                     HasSubstr("quaternion")));
  EXPECT_EQ(
      ReadKeyframeLog(WriteLog("refused_last.lcm", {{3, 0, 10, 10}, {3, 1, 20, 20, true}})).size(),
      2U);
}

TEST(KeyframeLog, SaysWhenThereIsNothing) {
  EXPECT_THAT(ErrorOf(WriteLog("empty.lcm", 1, {})), HasSubstr("no KEYFRAME_*"));
  EXPECT_THAT(ErrorOf("/nonexistent/log.lcm"), HasSubstr("no such log"));
}

// Two clocks that have nothing to do with each other: only the time since each log's start counts.
TEST(KeyframeLog, InterleavesByElapsedTime) {
  std::vector<std::vector<LoggedKeyframe>> logs;
  logs.push_back(ReadKeyframeLog(WriteLog("a.lcm", 1, {{0, 1000}, {1, 1500}, {2, 2000}})));
  logs.push_back(ReadKeyframeLog(WriteLog("b.lcm", 2, {{0, 90}, {1, 500}, {2, 1200}})));
  std::vector<std::pair<int32_t, int32_t>> order;
  std::vector<int64_t> elapsed_us;
  for (const LoggedKeyframe& keyframe : Interleave(logs)) {
    order.emplace_back(keyframe.id.map.agent_id, keyframe.id.seq);
    elapsed_us.push_back(keyframe.elapsed_us);
  }
  EXPECT_THAT(elapsed_us, testing::ElementsAre(0, 0, 410, 500, 1000, 1110));
  EXPECT_THAT(order, testing::ElementsAre(std::pair{1, 0}, std::pair{2, 0}, std::pair{2, 1},
                                          std::pair{1, 1}, std::pair{1, 2}, std::pair{2, 2}));
}

// Whole sessions: the second agent of each log has a clock of its own, and begins later.
TEST(KeyframeLog, InterleavesAgentsOfDifferentClocksByTheCaptureOfTheirFirstKeyframes) {
  std::vector<std::vector<LoggedKeyframe>> logs;
  logs.push_back(ReadKeyframeLog(WriteLog("two_clocks.lcm", {{1, 0, 900'000, 50},
                                                             {1, 1, 900'100, 150},
                                                             {2, 0, 7, 170},
                                                             {1, 2, 900'200, 250},
                                                             {2, 1, 107, 270}})));
  logs.push_back(ReadKeyframeLog(WriteLog(
      "two_other_clocks.lcm",
      {{3, 0, 40, 2000}, {4, 0, 800'000, 2060}, {3, 1, 150, 2110}, {4, 1, 800'100, 2160}})));
  std::vector<std::pair<int32_t, int64_t>> order;
  for (const LoggedKeyframe& keyframe : Interleave(logs)) {
    order.emplace_back(keyframe.id.map.agent_id, keyframe.elapsed_us);
  }
  EXPECT_THAT(order, testing::ElementsAre(std::pair{1, 0}, std::pair{3, 0}, std::pair{4, 60},
                                          std::pair{1, 100}, std::pair{3, 110}, std::pair{2, 120},
                                          std::pair{4, 160}, std::pair{1, 200}, std::pair{2, 220}));
}

}  // namespace
}  // namespace pangea

#include "log_tools/log_diff.h"
#include "log_file/log_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "messages/encoding.h"
#include "pangea/anchor_t.hpp"
#include "pangea/correction_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class LogDiffTest : public testing::Test {
 protected:
  // Corrections of agent 1 with these revisions, counted from the first, one a second.
  std::string Log(const std::string& name, const std::vector<int64_t>& revisions,
                  int64_t first_revision = 0) {
    std::string path = testing::TempDir() + "log_diff_" + name + "_" +
                       testing::UnitTest::GetInstance()->current_test_info()->name() + ".lcm";
    std::filesystem::remove(path);
    LogFileWriter file(path);
    int64_t utime = 1'000'000 * (1 + std::ssize(revisions));  // logs need not begin together
    status_t status{};
    status.utime = utime;
    file.Write(utime, "STATUS_posegraph", EncodeMessage(status));
    for (const int64_t revision : revisions) {
      correction_t correction{};
      correction.revision = revision + first_revision;
      correction.covariance[7] = 0.5 * static_cast<double>(revision);
      file.Write(utime += 1'000'000, "CORRECTION_1", EncodeMessage(correction));
      file.Write(utime, "CORRECTION_2", EncodeMessage(correction_t{}));
    }
    return path;
  }
};

TEST_F(LogDiffTest, TheSameMessagesAtOtherTimesAreTheSame) {
  const LogDiff diff = DiffLogs(Log("a", {1, 2, 3}), Log("b", {1, 2, 3}));
  EXPECT_EQ(diff.First(), nullptr);
  ASSERT_EQ(diff.channels.size(), 2u);  // status messages are not compared
  EXPECT_EQ(diff.channels[0].count_a, 3);
  EXPECT_THAT(ToText(diff), HasSubstr("no message differs"));
}

TEST_F(LogDiffTest, NamesTheFirstFieldOfTheFirstMessage) {
  const LogDiff diff = DiffLogs(Log("a", {1, 2, 3, 4}), Log("b", {1, 2, 5, 6}));
  ASSERT_NE(diff.First(), nullptr);
  EXPECT_EQ(diff.First()->channel, "CORRECTION_1");
  EXPECT_EQ(diff.First()->first, 2);
  EXPECT_EQ(diff.First()->seconds, 3);
  EXPECT_EQ(diff.First()->how, "covariance[7]: 1.5 | 2.5");
  EXPECT_THAT(ToText(diff), AllOf(HasSubstr("CORRECTION_2        4        4        4"),
                                  HasSubstr("part at 3.000 s, with message 2 on CORRECTION_1")));
}

// A live pose graph counts from the clock, a replayed one from 1.
TEST_F(LogDiffTest, RevisionsAreNotCompared) {
  const std::string live = Log("live", {1, 2, 3}, 1'795'000'000'000'000);
  EXPECT_EQ(DiffLogs(live, Log("replay", {1, 2, 3})).First(), nullptr);
  EXPECT_EQ(DiffLogs(live, Log("other", {1, 2, 4})).First()->first, 2);
}

// An anchor's pose names the revision of the group's state that it is from.
TEST_F(LogDiffTest, NorAreThoseOfAnAnchorsGroup) {
  const auto log_with_anchor = [this](const std::string& name, int64_t group_revision) {
    std::string path = Log(name, {});
    LogFileWriter file(path);
    anchor_t anchor{};
    anchor.group_revision = group_revision;
    file.Write(1, "ANCHOR", EncodeMessage(anchor));
    return path;
  };
  EXPECT_EQ(DiffLogs(log_with_anchor("live", 1'795'000'000'000'000), log_with_anchor("replay", 3))
                .First(),
            nullptr);
}

TEST_F(LogDiffTest, OneThatEndsFirst) {
  const std::string a = Log("a", {1, 2}), b = Log("b", {1, 2, 3});
  EXPECT_EQ(DiffLogs(a, b).First()->how, "the first has no more");
  EXPECT_EQ(DiffLogs(b, a).First()->how, "the second has no more");
  EXPECT_EQ(DiffLogs(b, a).First()->first, 2);
  EXPECT_EQ(DiffLogs(a, b, 2.5).First(), nullptr);
}

TEST_F(LogDiffTest, AChannelOfOneLogAloneComesLast) {
  LogDiff diff;
  diff.channels = {{"POSE_1", 9, 0, 0, 0.1, "the second has none"},
                   {"MAP_STATE", 4, 5, 4, 3.5, "the first has no more"}};
  EXPECT_EQ(diff.First()->channel, "MAP_STATE");
  diff.channels.pop_back();
  EXPECT_EQ(diff.First()->channel, "POSE_1");
}

TEST_F(LogDiffTest, AChannelOfOneLogAlone) {
  const LogDiff diff = DiffLogs(Log("a", {}), Log("b", {1}));
  ASSERT_EQ(diff.channels.size(), 2u);
  EXPECT_EQ(diff.channels[0].count_a, 0);
  EXPECT_EQ(diff.channels[0].first, 0);
  EXPECT_EQ(diff.channels[0].how, "the first has none");
  EXPECT_THROW(DiffLogs("/nonexistent.lcm", "/nonexistent.lcm"), std::runtime_error);
}

}  // namespace
}  // namespace pangea

#include "processes/kept_processes.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <thread>

namespace pangea {
namespace {

using testing::HasSubstr;

class KeptProcessesTest : public testing::Test {
 protected:
  // Waits until a process has ended and was started again.
  KeptProcesses::Revived NextRevived() {
    for (int i = 0; i < 1000; ++i) {
      const std::vector<KeptProcesses::Revived> revived = kept_.Revive();
      if (!revived.empty()) {
        return revived.front();
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ADD_FAILURE() << "nothing ended";
    return {};
  }

  KeptProcesses kept_{testing::TempDir()};
};

TEST_F(KeptProcessesTest, AKilledOneIsAnotherProcessOfThatName) {
  kept_.Start("kept_sleeps", {"/bin/sleep", "100"});
  const pid_t before = kept_.Find("kept_sleeps")->pid();
  EXPECT_EQ(kept_.Find("another"), nullptr);
  EXPECT_TRUE(kept_.Revive().empty());
  kept_.ExpectEnd("kept_sleeps");
  kept_.Find("kept_sleeps")->Signal(SIGKILL);
  KeptProcesses::Revived revived = NextRevived();
  EXPECT_EQ(revived.name, "kept_sleeps");
  EXPECT_THAT(revived.why, HasSubstr("signal 9"));
  EXPECT_EQ(revived.unexpected, 0);
  EXPECT_NE(kept_.Find("kept_sleeps")->pid(), before);
  kept_.Find("kept_sleeps")->Signal(SIGKILL);
  EXPECT_EQ(NextRevived().unexpected, 1);
  kept_.StopAll(5);
  EXPECT_FALSE(kept_.Find("kept_sleeps")->running());
}

TEST_F(KeptProcessesTest, OneThatEndsTooOftenIsGivenUp) {
  kept_.Start("kept_fails", {"/bin/sh", "-c", "echo at $(date +%N); exit 3"});
  KeptProcesses::Revived revived = NextRevived();
  EXPECT_THAT(revived.why, testing::StartsWith("exit code 3: at "));
  while (!revived.given_up && !HasFailure()) {
    revived = NextRevived();
  }
  EXPECT_EQ(revived.unexpected, KeptProcesses::kMaxRestarts + 1);
  EXPECT_TRUE(kept_.GivenUp("kept_fails"));
  EXPECT_TRUE(kept_.Revive().empty());
}

TEST_F(KeptProcessesTest, OneThatCannotStartIsGivenUpSoon) {
  kept_.Start("kept_cannot", {"/bin/sh", "-c", "echo no such device; exit 3"});
  kept_.Start("kept_sleeps", {"/bin/sleep", "100"});
  for (int i = 1; i < QuickDeaths::kMaxQuickDeaths; ++i) {
    EXPECT_FALSE(NextRevived().given_up);
  }
  const KeptProcesses::Revived revived = NextRevived();
  EXPECT_TRUE(revived.given_up);
  EXPECT_FALSE(revived.ever_ran);
  EXPECT_EQ(revived.why, "exit code 3: no such device");
  EXPECT_EQ(revived.unexpected, QuickDeaths::kMaxQuickDeaths);
  EXPECT_TRUE(kept_.GivenUp("kept_cannot"));
  EXPECT_FALSE(kept_.GivenUp("kept_sleeps"));
  EXPECT_TRUE(kept_.Revive().empty());
  kept_.StopAll(5);
}

TEST_F(KeptProcessesTest, OneWhoseLogCannotBeOpenedWaitsForIt) {
  const std::filesystem::path logs =
      std::filesystem::path(testing::TempDir()) / "kept_processes_logs";
  std::filesystem::remove_all(logs);
  std::filesystem::create_directory(logs);
  KeptProcesses kept(logs);
  kept.Start("kept_sleeps", {"/bin/sleep", "100"});
  std::filesystem::remove_all(logs);
  kept.Find("kept_sleeps")->Signal(SIGKILL);
  std::vector<KeptProcesses::Revived> revived;
  while (revived.empty()) {
    revived = kept.Revive();
  }
  EXPECT_THAT(revived.front().why, HasSubstr("cannot be written: No such file"));
  EXPECT_FALSE(revived.front().given_up);
  for (int i = 0; i < 2 * KeptProcesses::kMaxRestarts; ++i) {
    EXPECT_TRUE(kept.Revive().empty()) << "it is told once";
  }
  EXPECT_FALSE(kept.Find("kept_sleeps")->running());
  std::filesystem::create_directory(logs);
  revived = kept.Revive();
  ASSERT_EQ(revived.size(), 1u);
  EXPECT_EQ(revived.front().unexpected, 1);
  EXPECT_TRUE(kept.Find("kept_sleeps")->running());
  kept.StopAll(5);
}

TEST(QuickDeaths, AreInARowAndOfOneReason) {
  QuickDeaths deaths;
  EXPECT_FALSE(deaths.Note("a", 1));
  EXPECT_FALSE(deaths.Note("a", 1));
  EXPECT_FALSE(deaths.Note("a", 11));  // a long run before its death
  EXPECT_FALSE(deaths.Note("a", 1));
  EXPECT_FALSE(deaths.Note("b", 1));
  EXPECT_FALSE(deaths.Note("a", 1));
  EXPECT_FALSE(deaths.Note("a", 1));
  EXPECT_TRUE(deaths.Note("a", 1));
}

TEST(RecentEnds, AreThoseOfTheLastHour) {
  RecentEnds ends;
  for (int week = 0; week < 100; ++week) {
    ends.Note(week * 7 * 86'400.0);
    EXPECT_EQ(ends.count(), 1);
  }
  const double later_s = 101 * 7 * 86'400.0;
  for (int i = 1; i <= 6; ++i) {
    ends.Note(later_s + 600 * i);
    EXPECT_EQ(ends.count(), i);
  }
  ends.Note(later_s + 600 * 7);
  EXPECT_EQ(ends.count(), 6) << "the first is an hour old";
}

// lcm-logger, which uses select(), would die of a descriptor above 1023.
TEST_F(KeptProcessesTest, AChildHasNoneOfItsParentsFiles) {
  const int leak = open("/dev/null", O_RDONLY);
  ASSERT_GE(leak, 3);
  ChildProcess child("kept_lists", {"/bin/ls", "/proc/self/fd"},
                     testing::TempDir() + "kept_lists.txt");
  while (child.running()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  close(leak);
  EXPECT_EQ(child.LastLine(), "3");  // the descriptor of ls itself
}

}  // namespace
}  // namespace pangea

#include "session/kept_processes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <thread>

namespace pangea::session {
namespace {

using testing::HasSubstr;

class KeptProcessesTest : public testing::Test {
 protected:
  // Until one has ended and was started again.
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
  kept_.Start("kept_fails", {"/bin/sh", "-c", "echo no such device; exit 3"});
  KeptProcesses::Revived revived = NextRevived();
  EXPECT_EQ(revived.why, "exit code 3: no such device");
  EXPECT_FALSE(revived.last);
  while (!revived.last && !HasFailure()) {
    revived = NextRevived();
  }
  EXPECT_EQ(revived.unexpected, 20);
  while (kept_.Find("kept_fails")->running()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_TRUE(kept_.Revive().empty());
}

}  // namespace
}  // namespace pangea::session

#include "bus/status_log.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "bus/node.h"

namespace pangea {
namespace {

TEST(StateChanges, NumbersAreNoChange) {
  StateChanges changes;
  EXPECT_EQ(changes.Take(0, "connected, 3 waiting"), "connected, 3 waiting");
  EXPECT_EQ(changes.Take(10'000'000, "connected, 12 waiting"), std::nullopt);
  EXPECT_EQ(changes.Take(20'000'000, "away, 12 waiting"), "away, 12 waiting");
}

TEST(StateChanges, AFlickeringOneIsBounded) {
  StateChanges changes;
  int told = 0;
  for (int64_t second = 0; second < 60; ++second) {
    told += changes.Take(second * 1'000'000, second % 2 == 0 ? "on" : "off") ? 1 : 0;
  }
  EXPECT_LE(told, 12);
  EXPECT_GE(told, 10);
}

TEST(StatusLog, TellsStatesAndEachReasonOnceAfterTheStart) {
  LocalBus bus;
  Node node(bus, "test");
  testing::internal::CaptureStderr();
  node.Refuse("before");
  node.PublishStatus(0, 0, "waits");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  testing::internal::CaptureStderr();
  StartLog("pangea-test", "bus memq://");
  node.Refuse("image: no CAMERA yet");
  node.Refuse("image: no CAMERA yet");
  node.PublishStatus(10'000'000, 0, "works");
  node.PublishStatus(20'000'000, 0, "works");
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "pangea-test: started; bus memq://\n"
            "test: the first refused: image: no CAMERA yet\n"
            "test: works\n");
}

// The disk that is full may be that of the log: the process must go on.
TEST(StatusLogDeathTest, AFullDiskIsNoEnd) {
  EXPECT_EXIT(
      {
        dup2(open("/dev/full", O_WRONLY), STDERR_FILENO);
        StartLog("pangea-test", "bus memq://");
        Log("test", "THE DISK REFUSES WRITES");
        _exit(0);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace pangea

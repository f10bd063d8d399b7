// Tests how programs behave when somebody sets the machine's clock. This test's clock_gettime
// replaces that of the C library, for the standard library's clocks too.

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <thread>

#include "bus/node.h"
#include "bus/process.h"
#include "bus/retransmission/playback_pace.h"

namespace {

std::atomic<time_t> stepped_s = 0;

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const auto result = static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  time->tv_sec += clock == CLOCK_REALTIME ? stepped_s.load() : 0;
  return result;
}

namespace pangea {
namespace {

int64_t SystemMicros() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

class WallClockTest : public ::testing::TestWithParam<time_t> {
 protected:
  WallClockTest() { stepped_s = 0; }
  ~WallClockTest() override { stepped_s = 0; }
};

class Ticking : public Process {
 public:
  explicit Ticking(Bus& bus)
      : node_(bus, "ticking"), publisher_(node_, 1, /*kept=*/1, WallUtime()) {}
  void Tick(int64_t now_utime) override {
    ++ticks;
    newest_utime = now_utime;
  }
  const ReliableKeyframePublisher& publisher() const { return publisher_; }

  int ticks = 0;
  int64_t newest_utime = 0;

 private:
  Node node_;
  ReliableKeyframePublisher publisher_;
};

TEST_P(WallClockTest, IsTheWallClockAtTheStartAndNeverSteps) {
  const int64_t before = WallUtime();
  const int64_t system_before = SystemMicros();
  EXPECT_LT(std::abs(before - system_before), 1'000'000);
  stepped_s = GetParam();
  ASSERT_GT(std::abs(SystemMicros() - system_before), 3'000'000'000) << "this test's own step";
  const int64_t after = WallUtime();
  EXPECT_GE(after, before);
  EXPECT_LT(after - before, 1'000'000);
}

TEST_P(WallClockTest, PlaybackTicksOnAtItsPace) {
  LocalBus local;
  Ticking process(local);
  PlaybackPace pace(nullptr, process, process.publisher());
  const int64_t begin = SteadyMicros();
  while (SteadyMicros() < begin + 1'000'000) {
    stepped_s = SteadyMicros() < begin + 300'000 ? 0 : GetParam();
    pace.Serve(20);
  }
  EXPECT_GE(process.ticks, 5) << "ten in a second, three before the step";
  EXPECT_LE(process.ticks, 11);
  EXPECT_LT(std::abs(process.newest_utime - WallUtime()), 1'000'000);
}

INSTANTIATE_TEST_SUITE_P(AnHour, WallClockTest, ::testing::Values(-3600, 3600));

// STATUS and HAVE come from here.
TEST(RunProcess, TicksOnWhenTheClockIsSetBack) {
  LocalBus local;
  Ticking process(local);
  LcmBus bus("memq://");
  std::thread loop([&] { RunProcess(bus, process); });
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  stepped_s = -3600;
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  kill(getpid(), SIGTERM);
  loop.join();
  EXPECT_GE(process.ticks, 5) << "ten in a second, three before the step";
}

}  // namespace
}  // namespace pangea

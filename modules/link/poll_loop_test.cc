#include "link/poll_loop.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <thread>

namespace pangea {
namespace {

constexpr int kMessages = 60;
constexpr std::chrono::milliseconds kTakes{3};

// Handling a message takes time; Poll must be called before all waiting messages are handled.
class Slow : public PolledProcess {
 public:
  explicit Slow(LcmBus& bus) {
    bus.Subscribe("A", [this](const std::string&, Bytes) {
      std::this_thread::sleep_for(kTakes);
      ++handled;
    });
  }
  int Poll(int64_t /*steady_us*/) override {
    ++polls;
    if (handled == kMessages) {
      std::raise(SIGINT);
    }
    return 1;
  }
  void Tick(int64_t /*now_utime*/) override {}

  int handled = 0;
  int polls = 0;
};

TEST(PollLoop, AFloodOfMessagesDoesNotKeepItFromSending) {
  LcmBus a("memq://"), b("memq://");
  Slow process(a);
  for (int i = 0; i < kMessages; ++i) {
    a.Publish("A", {});
  }
  OptionsAnnouncer options(b, "slow", "");
  EXPECT_EQ(RunPolledProcess(a, b, process, options), 0);
  EXPECT_EQ(process.handled, kMessages);
  EXPECT_GE(process.polls, kMessages / 2);
}

}  // namespace
}  // namespace pangea

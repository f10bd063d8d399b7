#include "bus/process.h"

#include <algorithm>
#include <atomic>
#include <csignal>

namespace pangea {
namespace {

// Atomic, because the kernel may deliver a signal on any thread of the process.
std::atomic<int> stop_signals = 0;
static_assert(std::atomic<int>::is_always_lock_free, "or a signal's handler may not use it");

constexpr int64_t kTickInterval_us = 100'000;

}  // namespace

void InstallSignalHandlers() {
  struct sigaction action {};
  action.sa_handler = [](int) { ++stop_signals; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  // Writing beyond a limit of the file size (ulimit -f) must fail like a full disk; by default the
  // signal would end the process.
  std::signal(SIGXFSZ, SIG_IGN);
}

bool StopRequested() { return stop_signals != 0; }

int StopSignals() { return stop_signals; }

int RunProcess(LcmBus& bus, Process& process,
               const std::function<void(int64_t now_utime)>& between_messages) {
  InstallSignalHandlers();
  int64_t now = WallUtime(), next_tick = now;
  while (!StopRequested()) {
    const auto to_tick_ms = static_cast<int>((next_tick - now + 999) / 1000);
    bus.Handle(std::clamp(process.longest_wait_ms(), 0, std::max(to_tick_ms, 0)));
    now = WallUtime();
    if (between_messages) {
      between_messages(now);
    }
    if (now >= next_tick) {
      process.Tick(now);
      next_tick = now + kTickInterval_us;
    }
    process.BetweenMessages(now);
  }
  return 0;
}

}  // namespace pangea

#include "bus/process.h"

#include <dlfcn.h>

#include <atomic>
#include <csignal>

#include "bus/retransmission/journal_first.h"

namespace pangea {
namespace {

// A signal interrupts any of the process's threads: the bus's receiver, a test's main.
std::atomic<int> stop_signals = 0;
static_assert(std::atomic<int>::is_always_lock_free, "or a signal's handler may not use it");

constexpr int64_t kTickInterval_us = 100'000;

}  // namespace

void InstallSignalHandlers() {
  struct sigaction action {};
  action.sa_handler = [](int) { ++stop_signals; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  // A file that may not grow (a quota, ulimit -f) is a full disk like any other: an error, no
  // death.
  std::signal(SIGXFSZ, SIG_IGN);
}

bool StopRequested() { return stop_signals != 0; }

int StopSignals() { return stop_signals; }

// By name: only programs that solve have OpenMP in them. With no level of parallel regions allowed
// each region runs in one thread.
void UseOneThread() {
  if (void* const symbol = dlsym(RTLD_DEFAULT, "omp_set_max_active_levels")) {
    reinterpret_cast<void (*)(int)>(symbol)(0);
  }
}

int RunProcess(LcmBus& bus, Process& process, JournalFirstBus* journal_first) {
  InstallSignalHandlers();
  int64_t next_tick = 0;
  while (!StopRequested()) {
    bus.Handle(process.longest_wait_ms());
    const int64_t now = WallUtime();
    if (journal_first != nullptr) {
      journal_first->Poll(now);
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

#pragma once

// The main loop around a process class: messages, ticks, signals.

#include <cstdint>
#include <functional>

#include "bus/bus.h"
#include "bus/wall_clock.h"

namespace pangea {

// A process class, which has no loop of its own. Its message handlers, Tick and BetweenMessages run
// on one thread.
class Process {
 public:
  virtual ~Process() = default;
  // Housekeeping at about 10 Hz: resend requests, time-outs, status. A replay never calls it, so no
  // result may depend on it. `now_utime`: wall clock.
  virtual void Tick(int64_t now_utime) = 0;
  // For a process that serves more than the bus. Called after each message and tick, and when
  // neither came for longest_wait_ms.
  virtual void BetweenMessages(int64_t) {}
  virtual int longest_wait_ms() const { return 100; }
};

// After InstallSignalHandlers, SIGINT and SIGTERM make StopRequested true.
void InstallSignalHandlers();
bool StopRequested();
int StopSignals();  // number of such signals so far

// Handles messages and ticks until a signal; returns the exit code. `between_messages`, unless
// empty, is called before the process' own Tick and BetweenMessages.
int RunProcess(LcmBus& bus, Process& process,
               const std::function<void(int64_t now_utime)>& between_messages = {});

}  // namespace pangea

#pragma once

// The loop around a process class: bus, ticks, signals.

#include <cstdint>

#include "bus/bus.h"
#include "bus/wall_clock.h"

namespace pangea {

// A process without its loop. Handlers run between Ticks, on one thread.
class Process {
 public:
  virtual ~Process() = default;
  // Housekeeping at about 10 Hz: resend requests, time-outs, status. Never called in a replay, so
  // no result may depend on it.
  virtual void Tick(int64_t now_utime) = 0;
  // What else a process serves beside the bus: called after each message, and when none came for
  // longest_wait_ms.
  virtual void BetweenMessages(int64_t) {}
  virtual int longest_wait_ms() const { return 50; }
};

// Set by SIGINT and SIGTERM once InstallSignalHandlers has run.
void InstallSignalHandlers();
bool StopRequested();
int StopSignals();  // how many came

// What is solved is solved in the thread that asks for it. CHOLMOD would start three more, which
// OMP_NUM_THREADS does not keep it from: it asks OpenMP for four by number. Call it at the start.
void UseOneThread();

class JournalFirstBus;

// Handles messages and ticks until a signal. Returns the exit code.
int RunProcess(LcmBus& bus, Process& process, JournalFirstBus* journal_first = nullptr);

}  // namespace pangea

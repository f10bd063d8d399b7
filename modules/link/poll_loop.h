#pragma once

// The main loop of a process that joins two buses and paces what it sends. It waits for messages of
// both buses, and calls Poll as often as the process asks.

#include <cstdint>

#include "bus/options_announcer.h"
#include "bus/process.h"

namespace pangea {

class PolledProcess : public Process {
 public:
  // `steady_us`: monotonic clock. Returns the milliseconds after which it must be called again if
  // no message arrives before.
  virtual int Poll(int64_t steady_us) = 0;
};

// Handles messages, polls and ticks until a signal, and publishes the process' options. Returns the
// exit code.
int RunPolledProcess(LcmBus& a, LcmBus& b, PolledProcess& process, OptionsAnnouncer& options);

}  // namespace pangea

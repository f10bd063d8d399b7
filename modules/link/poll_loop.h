#pragma once

// The loop of a process that joins two buses and paces what it sends: it waits on both buses' file
// descriptors, and calls Poll as often as the process asks.

#include <cstdint>

#include "bus/options_announcer.h"
#include "bus/process.h"

namespace pangea {

class PolledProcess : public Process {
 public:
  // `steady_us`: a clock that never steps. Returns after how many milliseconds it wants to be
  // called again, if nothing arrives before.
  virtual int Poll(int64_t steady_us) = 0;
};

// Handles messages, polls and ticks until a signal; tells the process' options. Returns the exit
// code.
int RunPolledProcess(LcmBus& a, LcmBus& b, PolledProcess& process, OptionsAnnouncer& options);

}  // namespace pangea

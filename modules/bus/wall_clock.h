#pragma once

// The clocks of a process, in microseconds.

#include <cstdint>

namespace pangea {

// Microseconds since 1970 that never step: the wall clock as it was when the process first asked,
// and from there as SteadyMicros goes. So what is paced by it goes on as it should when somebody
// sets the clock; what is stamped by it (statuses, maps, the journal) is of the new time from the
// next start on.
int64_t WallUtime();
// Monotonic clock.
int64_t SteadyMicros();

}  // namespace pangea

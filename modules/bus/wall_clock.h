#pragma once

// The clocks of a process.

#include <cstdint>

namespace pangea {

// Microseconds since 1970, which never step: the wall clock at the first call, plus the time since
// then by SteadyMicros. So pacing is not disturbed when somebody sets the clock. Timestamps
// (statuses, maps, the journal) use the new time only after the next start.
int64_t WallUtime();
// Monotonic clock.
int64_t SteadyMicros();
double SteadySeconds();

}  // namespace pangea

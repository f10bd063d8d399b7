#include "bus/wall_clock.h"

#include <chrono>

namespace pangea {
namespace {

template <typename Clock>
int64_t MicrosOf() {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch())
      .count();
}

}  // namespace

int64_t WallUtime() {
  static const int64_t begin = MicrosOf<std::chrono::system_clock>() - SteadyMicros();
  return begin + SteadyMicros();
}

int64_t SteadyMicros() { return MicrosOf<std::chrono::steady_clock>(); }

double SteadySeconds() { return 1e-6 * static_cast<double>(SteadyMicros()); }

}  // namespace pangea

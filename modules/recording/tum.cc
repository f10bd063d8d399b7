#include "recording/tum.h"

#include <fmt/format.h>

#include <cstdlib>

namespace pangea {

std::string ToTum(const Trajectory& trajectory) {
  std::string text;
  for (const auto& [utime, T] : trajectory) {
    const int64_t magnitude = std::abs(utime);
    text +=
        fmt::format("{}{}.{:06d}", utime < 0 ? "-" : "", magnitude / 1000000, magnitude % 1000000);
    for (const double v : {T.t.x(), T.t.y(), T.t.z(), T.q.x(), T.q.y(), T.q.z(), T.q.w()}) {
      text += fmt::format(" {:.9f}", v);
    }
    text += '\n';
  }
  return text;
}

}  // namespace pangea

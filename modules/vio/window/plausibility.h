#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "vio/window/window_state.h"

namespace pangea::vio {

// Why the newest frame's estimate cannot be right; nothing if it is plausible. `last_tracked`:
// utime of the newest tracked image.
std::optional<std::string> Implausible(const WindowFrame& newest, int64_t last_tracked);

}  // namespace pangea::vio

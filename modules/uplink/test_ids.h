#pragma once

// Maps, anchors and times that the tests of the uplink use.

#include <cstdint>

#include "core/anchor.h"
#include "core/ids.h"

namespace pangea {

constexpr MapId kMap{1, 1000}, kLaterMap{1, 2000};
constexpr AnchorId kA{1, 1}, kB{1, 2};
constexpr int64_t kSecond = 1'000'000;  // microseconds

}  // namespace pangea

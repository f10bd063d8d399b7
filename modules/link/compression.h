#pragma once

// Keyframes on the link, compressed by zstd. Descriptors, three quarters of a keyframe, hardly give
// way; the rest halves (docs/decisions/link_security.md).

#include <cstdint>
#include <optional>
#include <vector>

#include "bus/bus.h"

namespace pangea {

std::vector<uint8_t> Compress(Bytes data);
// Nothing if it is damaged, or would be larger than `max_bytes`; no memory is taken before that is
// known.
std::optional<std::vector<uint8_t>> Decompress(Bytes compressed, size_t max_bytes);

}  // namespace pangea

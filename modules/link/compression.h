#pragma once

// Compression of keyframes on the link, by zstd. Descriptors, three quarters of a keyframe, hardly
// compress; the rest shrinks to half its size (docs/decisions/link_security.md).

#include <cstdint>
#include <optional>
#include <vector>

#include "core/bytes.h"

namespace pangea {

std::vector<uint8_t> Compress(Bytes data);
// Nothing if the data are damaged or would be larger than `max_bytes`. The size is checked before
// any memory is allocated.
std::optional<std::vector<uint8_t>> Decompress(Bytes compressed, size_t max_bytes);

}  // namespace pangea

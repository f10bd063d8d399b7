#pragma once

#include <cstdint>
#include <span>

namespace pangea {

using Bytes = std::span<const uint8_t>;

}  // namespace pangea

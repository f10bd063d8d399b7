#include "link/compression.h"

#include <fmt/format.h>
#include <zstd.h>

#include <stdexcept>

namespace pangea {
namespace {

// The lowest level with zstd's optimal parser: 1.3 ms per keyframe here, and 1.7 % smaller than
// with level 6. Higher levels gain nothing.
constexpr int kLevel = 15;

}  // namespace

std::vector<uint8_t> Compress(Bytes data) {
  std::vector<uint8_t> compressed(ZSTD_compressBound(data.size()));
  const size_t size =
      ZSTD_compress(compressed.data(), compressed.size(), data.data(), data.size(), kLevel);
  if (ZSTD_isError(size) != 0) {
    throw std::runtime_error(fmt::format("zstd: {}", ZSTD_getErrorName(size)));
  }
  compressed.resize(size);
  return compressed;
}

std::optional<std::vector<uint8_t>> Decompress(Bytes compressed, size_t max_bytes) {
  const unsigned long long size = ZSTD_getFrameContentSize(compressed.data(), compressed.size());
  // zstd's values for an unknown or unreadable size are larger too.
  if (size > max_bytes) {
    return std::nullopt;
  }
  std::vector<uint8_t> data(size);
  if (ZSTD_decompress(data.data(), data.size(), compressed.data(), compressed.size()) != size) {
    return std::nullopt;
  }
  return data;
}

}  // namespace pangea

#pragma once

// Writes and reads compact bodies of link packets: fixed-size little-endian values and
// variable-length integers. The reader never throws and never reads past the end: after an error
// all values are zero or empty, and ok() is false.

#include <bit>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "core/bytes.h"

namespace pangea {

static_assert(std::endian::native == std::endian::little);

class WireWriter {
 public:
  template <typename T>
  requires std::integral<T> || std::floating_point<T>
  void Fixed(T value) {
    const auto* begin = reinterpret_cast<const uint8_t*>(&value);
    bytes_.insert(bytes_.end(), begin, begin + sizeof(T));
  }
  // Seven bits per byte, the lowest bits first.
  void Varint(uint64_t value) {
    for (; value >= 0x80; value >>= 7) {
      bytes_.push_back(static_cast<uint8_t>(value | 0x80));
    }
    bytes_.push_back(static_cast<uint8_t>(value));
  }
  void Raw(Bytes bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  void Sized(Bytes bytes) {
    Varint(bytes.size());
    Raw(bytes);
  }
  void Text(std::string_view text) {
    Sized({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  }
  std::vector<uint8_t> Take() { return std::move(bytes_); }

 private:
  std::vector<uint8_t> bytes_;
};

class WireReader {
 public:
  explicit WireReader(Bytes bytes) : rest_(bytes) {}

  template <typename T>
  requires std::integral<T> || std::floating_point<T> T Fixed() {
    T value{};
    const Bytes raw = Raw(sizeof(T));
    if (raw.size() == sizeof(T)) {
      std::memcpy(&value, raw.data(), sizeof(T));
    }
    return value;
  }
  // A value above `max` is an error.
  uint64_t Varint(uint64_t max) {
    uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const auto byte = Fixed<uint8_t>();
      value |= static_cast<uint64_t>(byte & 0x7F) << shift;
      if ((byte & 0x80) == 0) {
        ok_ = ok_ && value <= max;
        return ok_ ? value : 0;
      }
    }
    ok_ = false;
    return 0;
  }
  Bytes Raw(size_t count) {
    if (!ok_ || count > rest_.size()) {
      ok_ = false;
      return {};
    }
    const Bytes raw = rest_.first(count);
    rest_ = rest_.subspan(count);
    return raw;
  }
  Bytes Sized(uint64_t max) { return Raw(Varint(max)); }
  std::string Text(uint64_t max) {
    const Bytes raw = Sized(max);
    return {raw.begin(), raw.end()};
  }
  Bytes Rest() { return Raw(rest_.size()); }

  bool ok() const { return ok_; }
  // All bytes were read, without an error.
  bool AtEnd() const { return ok_ && rest_.empty(); }

 private:
  Bytes rest_;
  bool ok_ = true;
};

}  // namespace pangea

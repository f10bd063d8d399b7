#pragma once

// Seeded random numbers, the same on every machine: the standard engine with own distributions (the
// standard's are implementation-defined).

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string_view>

namespace pangea::sim {

// splitmix64's finaliser (Steele et al., 2014).
inline uint64_t Mix(uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

// FNV-1a over bytes, for names of streams and of cached frames.
inline uint64_t HashBytes(const void* data, size_t size, uint64_t hash = 0xCBF29CE484222325ull) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (size_t i = 0; i < size; ++i) {
    hash = (hash ^ bytes[i]) * 0x100000001B3ull;
  }
  return hash;
}

class Rng {
 public:
  // Streams of different names are independent.
  Rng(uint64_t seed, std::string_view stream)
      : engine_(Mix(seed) ^ HashBytes(stream.data(), stream.size())) {}

  double Uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  // 0 .. count - 1
  int Index(int count) { return static_cast<int>(Uniform() * count); }
  bool Chance(double probability) { return Uniform() < probability; }
  double Normal() {  // Box-Muller
    const double radius = std::sqrt(-2.0 * std::log(1.0 - Uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * Uniform());
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace pangea::sim

#pragma once

#include "core/descriptor.h"

namespace pangea {

template <typename Random>
Descriptor RandomDescriptor(Random& random) {
  Descriptor descriptor;
  for (uint64_t& word : descriptor) {
    word = random();
  }
  return descriptor;
}

inline void FlipBit(Descriptor* descriptor, size_t bit) {
  (*descriptor)[bit / 64] ^= uint64_t{1} << (bit % 64);
}

}  // namespace pangea

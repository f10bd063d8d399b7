#pragma once

// Heap and CPU use of this process, for benches.

#include <malloc.h>

#include <ctime>

namespace pangea::bench {

inline double HeapBytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

inline double CpuMs() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

}  // namespace pangea::bench

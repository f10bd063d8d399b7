#pragma once

// Heap and CPU use of this process, for benches; of several cores in it, by the name of the process
// to which each belongs.

#include <malloc.h>

#include <ctime>
#include <map>
#include <string>
#include <type_traits>

namespace pangea::bench {

inline double HeapBytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

inline double CpuMs() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

struct Use {
  double heap_bytes = 0;
  double cpu_ms = 0;
};

class UseByProcess {
 public:
  // Runs `work`, adds its use to that of `process`, and returns its result.
  template <typename Work>
  auto Measure(const std::string& process, const Work& work) {
    const double heap = HeapBytes(), cpu_ms = CpuMs();
    const auto account = [&] {
      Use& use = use_[process];
      // CPU first: HeapBytes takes longer for a fragmented heap.
      use.cpu_ms += CpuMs() - cpu_ms;
      use.heap_bytes += HeapBytes() - heap;
    };
    if constexpr (std::is_void_v<decltype(work())>) {
      work();
      account();
    } else {
      auto result = work();
      account();
      return result;
    }
  }

  // cpu_ms is that since the last call.
  std::map<std::string, Use> Take() {
    std::map<std::string, Use> use = use_;
    for (auto& [process, own] : use_) {
      own.cpu_ms = 0;
    }
    return use;
  }

 private:
  std::map<std::string, Use> use_;
};

}  // namespace pangea::bench

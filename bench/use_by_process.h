#pragma once

// Heap and CPU of several cores in one process, by the name of the process that each would be.

#include <map>
#include <string>
#include <type_traits>

#include "bench/process_use.h"

namespace pangea::bench {

struct Use {
  double heap_bytes = 0;
  double cpu_ms = 0;
};

class UseByProcess {
 public:
  // What `work` returns; what it used is the process'.
  template <typename Work>
  auto Measure(const std::string& process, const Work& work) {
    const double heap = HeapBytes(), cpu_ms = CpuMs();
    const auto account = [&] {
      Use& use = use_[process];
      // The CPU first: HeapBytes takes longer the more pieces the heap is in.
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

  // The CPU is that since it was last asked.
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

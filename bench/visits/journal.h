#pragma once

// What the server has journalled over many visits. Thinned, it is what the server starts from.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bench/cores/step.h"
#include "thinning/thinning.h"

namespace pangea::bench {

struct Journal {
  struct Entry {
    Step step;
    int64_t journalled_utime = 0;
  };
  std::vector<std::vector<Entry>> maps;  // the oldest map first; ascending seq

  size_t num_keyframes() const;
  size_t num_accepted() const;
  // Thins the journal as pangea-site does.
  void Thin(const Thinning::Options& options, int64_t now_utime);
};

}  // namespace pangea::bench

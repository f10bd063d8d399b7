#pragma once

// Runs verification tasks on several threads, with the same results as on one. Not thread safe
// itself.

#include <cstddef>
#include <vector>

#include "core/server_messages.h"
#include "loop_verification/loop_verifier.h"

namespace pangea {

class AlignmentThreads {
 public:
  // `threads`: at least 1, the caller's own.
  AlignmentThreads(const LoopVerificationOptions& options, int threads)
      : aligners_(threads, Aligner(options)) {}

  // So many tasks keep the threads busy, although some take longer than others.
  size_t max_tasks() const {
    constexpr size_t kTasksAThread = 4;
    return aligners_.size() == 1 ? 1 : kTasksAThread * aligners_.size();
  }

  // The results, in the order of the tasks.
  std::vector<Constraint> Run(const std::vector<VerificationTask>& tasks);

 private:
  std::vector<Aligner> aligners_;  // one a thread
};

}  // namespace pangea

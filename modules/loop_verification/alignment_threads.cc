#include "loop_verification/alignment_threads.h"

#include <algorithm>
#include <atomic>
#include <functional>
#include <future>

namespace pangea {

std::vector<Constraint> AlignmentThreads::Run(const std::vector<VerificationTask>& tasks) {
  std::vector<Constraint> results(tasks.size());
  std::atomic<size_t> next = 0;
  const auto work = [&](Aligner& aligner) {
    for (size_t i = next++; i < tasks.size(); i = next++) {
      results[i] = tasks[i].Run(&aligner);
    }
  };
  std::vector<std::future<void>> others;
  for (size_t i = 1; i < std::min(aligners_.size(), tasks.size()); ++i) {
    others.push_back(std::async(std::launch::async, work, std::ref(aligners_[i])));
  }
  work(aligners_[0]);
  for (std::future<void>& other : others) {
    other.get();
  }
  return results;
}

}  // namespace pangea

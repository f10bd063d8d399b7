#include "bench/recognition/curve.h"

#include <algorithm>
#include <set>

namespace pangea::bench {
namespace {

// Accumulates the candidates that pass, one after another.
class Count {
 public:
  explicit Count(const std::vector<KeyframeId>& with_overlap)
      : missing_(with_overlap.begin(), with_overlap.end()), with_overlap_(missing_.size()) {}

  void Pass(const Scored& scored) {
    ++sum_.passed;
    if (scored.right) {
      ++sum_.right;
      sum_.found += missing_.erase(scored.query);
    }
  }

  PrecisionRecall Now() const {
    PrecisionRecall now = sum_;
    now.precision = Share(now.right, now.passed);
    now.recall = Share(now.found, with_overlap_);
    return now;
  }

 private:
  static double Share(size_t part, size_t whole) {
    return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
  }

  std::set<KeyframeId> missing_;
  size_t with_overlap_;
  PrecisionRecall sum_;
};

}  // namespace

PrecisionRecall AsDecided(const std::vector<Scored>& scored,
                          const std::vector<KeyframeId>& with_overlap) {
  Count count(with_overlap);
  for (const Scored& one : scored) {
    if (one.passed) {
      count.Pass(one);
    }
  }
  return count.Now();
}

std::vector<PrecisionRecall> OverThresholds(std::vector<Scored> scored,
                                            const std::vector<KeyframeId>& with_overlap) {
  std::stable_sort(scored.begin(), scored.end(),
                   [](const Scored& a, const Scored& b) { return a.score > b.score; });
  Count count(with_overlap);
  std::vector<PrecisionRecall> curve;
  for (size_t i = 0; i < scored.size(); ++i) {
    count.Pass(scored[i]);
    if (i + 1 == scored.size() || scored[i + 1].score < scored[i].score) {
      curve.push_back(count.Now());
    }
  }
  return curve;
}

}  // namespace pangea::bench

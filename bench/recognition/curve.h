#pragma once

// Precision and recall of one stage.
//
// Precision: the share of what passes that is right. Recall: of the keyframes that have a place to
// be recognised, the share for which at least one right candidate passes.

#include <vector>

#include "core/ids.h"

namespace pangea::bench {

// A candidate at one stage.
struct Scored {
  KeyframeId query;
  double score = 0;  // the higher, the surer the stage is
  bool right = false;
  bool passed = false;  // as the system decides
};

struct PrecisionRecall {
  size_t passed = 0;
  size_t right = 0;  // of those
  size_t found = 0;  // keyframes with a right one among those
  double precision = 0;
  double recall = 0;
};

// As the system decides. `with_overlap`: the keyframes that have a place to be recognised.
PrecisionRecall AsDecided(const std::vector<Scored>& scored,
                          const std::vector<KeyframeId>& with_overlap);
// If instead all passed whose score is at least a threshold: for each score that occurs, highest
// first.
std::vector<PrecisionRecall> OverThresholds(std::vector<Scored> scored,
                                            const std::vector<KeyframeId>& with_overlap);

}  // namespace pangea::bench

#pragma once

// Precision and recall of one stage.
//
// Precision: the share of right candidates among those that pass. Recall: among the keyframes with
// a place to be recognised, the share for which at least one right candidate passes.

#include <vector>

#include "core/ids.h"

namespace pangea::bench {

// A candidate at one stage.
struct Scored {
  KeyframeId query;
  double score = 0;  // higher: the stage is more certain
  bool right = false;
  bool passed = false;  // by the system's own decision
};

struct PrecisionRecall {
  size_t passed = 0;
  size_t right = 0;  // right ones among those that passed
  size_t found = 0;  // keyframes with at least one right candidate that passed
  double precision = 0;
  double recall = 0;
};

// For the system's own decisions. `with_overlap`: the keyframes with a place to be recognised.
PrecisionRecall AsDecided(const std::vector<Scored>& scored,
                          const std::vector<KeyframeId>& with_overlap);
// For decisions by a threshold on the score instead: one entry per score that occurs, highest
// first.
std::vector<PrecisionRecall> OverThresholds(std::vector<Scored> scored,
                                            const std::vector<KeyframeId>& with_overlap);

}  // namespace pangea::bench

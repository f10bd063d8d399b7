#pragma once

// Loops within one map (the paper, section IV.C): candidates of kind intra, one verdict each.
//
// In: keyframes of all maps; candidates of which both keyframes are of one map. Out: a Constraint
// between the two bodies with its covariance, or the reason it was refused. PnP, then bundle
// adjustment of the windows before both keyframes, as in fusion; besides, the drift the loop would
// mean must be one that odometry can make over that path.

#include "loop_verification/pair_judge.h"

namespace pangea {

struct InterMapBaOptions {
  AlignmentOptions alignment;
  DriftGateOptions drift;
};

class InterMapBa : public PairJudge {
 public:
  explicit InterMapBa(const InterMapBaOptions& options)
      : PairJudge(options.alignment, options.drift) {}

  Constraint Judge(const KeyframeId& query, const PlaceCandidate& candidate,
                   AlignmentReport* report = nullptr) override {
    return query.map == candidate.match.map
               ? PairJudge::Judge(query, candidate, report)
               : RefusedConstraint(query, candidate, "intra, but of two maps");
  }
};

}  // namespace pangea

#pragma once

// Loops within one map (the paper, section IV.C): candidates of kind intra, one verification result
// each.
//
// In: keyframes of all maps; candidates of which both keyframes are of one map. Out: a Constraint
// between the two bodies with its covariance, or the reason it was refused. PnP, then bundle
// adjustment of the windows before both keyframes, as in fusion; besides, the drift the loop would
// mean must be one that odometry can make over that path.

#include "loop_verification/loop_verifier.h"

namespace pangea {

using InterMapBaOptions = LoopVerifierOptions;

class InterMapBa : public LoopVerifier {
 public:
  using LoopVerifier::LoopVerifier;

  Constraint Verify(const KeyframeId& query, const PlaceCandidate& candidate,
                    LoopVerificationReport* report = nullptr) override {
    return query.map == candidate.match.map
               ? LoopVerifier::Verify(query, candidate, report)
               : RefusedConstraint(query, candidate, "intra, but of two maps");
  }
};

}  // namespace pangea

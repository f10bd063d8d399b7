#pragma once

// Loop closures within one map (the paper, section IV.C): verifies candidates of kind intra, with
// one verification result each.
//
// Input: keyframes of all maps; candidates with both keyframes in one map. Output: a Constraint
// between the two bodies with its covariance, or the reason of its refusal. The steps are those of
// fusion: PnP, then bundle adjustment of the windows up to both keyframes. In addition, the drift
// that the loop implies must be possible for odometry over that path (drift_gate.h).

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

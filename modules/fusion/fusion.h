#pragma once

// Visual fusion of maps (the paper, section IV.D): verifies candidates of kind inter, with one
// verification result each.
//
// Input: keyframes of all maps; candidates (query K_c of map c, match K_m of map m). Output: a
// Constraint between the two bodies with its covariance, or the reason of its refusal. Maps are not
// merged here: the pose graph decides from the constraints which maps form a group.

#include "loop_verification/loop_verifier.h"

namespace pangea {

using FusionOptions = LoopVerifierOptions;

class Fusion : public LoopVerifier {
 public:
  using LoopVerifier::LoopVerifier;
};

}  // namespace pangea

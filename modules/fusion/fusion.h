#pragma once

// Visual fusion of maps (the paper, section IV.D): candidates of kind inter, one verification
// result each.
//
// In: keyframes of all maps; candidates (query K_c of map c, match K_m of map m). Out: a Constraint
// between the two bodies with its covariance, or the reason it was refused. Which maps form a
// group follows from the constraints and is the posegraph's to say: nothing is glued here.

#include "loop_verification/loop_verifier.h"

namespace pangea {

using FusionOptions = LoopVerifierOptions;

class Fusion : public LoopVerifier {
 public:
  using LoopVerifier::LoopVerifier;
};

}  // namespace pangea

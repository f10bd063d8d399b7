#pragma once

// Visual fusion of maps (the paper, section IV.D): candidates of kind inter, one verification
// result each.
//
// In: keyframes of all maps; candidates (query K_c of map c, match K_m of map m). Out: a Constraint
// between the two bodies with its covariance, or the reason it was refused. Which maps form a
// group follows from the constraints and is the posegraph's to say: nothing is glued here.

#include "loop_verification/loop_verifier.h"

namespace pangea {

struct FusionOptions {
  LoopVerificationOptions alignment;
  // For a candidate within one map that is in a group with others.
  DriftGateOptions drift;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("alignment", &alignment, "verification of a candidate, step by step");
    archive.Section("drift", &drift,
                    "the odometry's drift that a constraint within one map may claim");
  }
};

class Fusion : public LoopVerifier {
 public:
  explicit Fusion(const FusionOptions& options, std::shared_ptr<RecordStore> records = nullptr)
      : LoopVerifier(options.alignment, options.drift, std::move(records)) {}
};

}  // namespace pangea

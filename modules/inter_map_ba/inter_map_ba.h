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

struct InterMapBaOptions {
  LoopVerificationOptions alignment;
  DriftGateOptions drift;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("alignment", &alignment, "verification of a candidate, step by step");
    archive.Section("drift", &drift,
                    "the odometry's drift that a constraint within one map may claim");
  }
};

class InterMapBa : public LoopVerifier {
 public:
  explicit InterMapBa(const InterMapBaOptions& options,
                      std::shared_ptr<RecordStore> records = nullptr)
      : LoopVerifier(options.alignment, options.drift, std::move(records)) {}

  Constraint Verify(const KeyframeId& query, const PlaceCandidate& candidate,
                    LoopVerificationReport* report = nullptr) override {
    return query.map == candidate.match.map
               ? LoopVerifier::Verify(query, candidate, report)
               : RefusedConstraint(query, candidate, "intra, but of two maps");
  }
};

}  // namespace pangea

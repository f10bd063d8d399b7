#pragma once

// Verifies a candidate pair of keyframes: the geometry that inter_map_ba and fusion share (the
// paper, section IV.D).
//
// Input: the keyframes up to the match (m) and up to the query (c), and the candidate's matched
// corners. Output: a Constraint between the two bodies, accepted with its covariance or refused
// with the reason. The same input gives the same result. Not thread safe.

#include <algorithm>
#include <optional>

#include "loop_verification/steps/steps.h"
#include "loop_verification/window_cache.h"

namespace pangea {

class Aligner {
 public:
  // A verification result depends on this many keyframes up to each of the two.
  static constexpr int kNumKeyframes = std::max(kMaxWindowKeyframes, kVisibilityKeyframes);

  explicit Aligner(LoopVerificationOptions options) : options_(options) {}

  // `keyframes`: kNumKeyframes up to the match and up to the query; fewer near the start of a map.
  // `drift_gate`: only within one map.
  Constraint Align(const CandidateKeyframes& keyframes, const PlaceCandidate& candidate,
                   const std::optional<DriftGate>& drift_gate,
                   LoopVerificationReport* report = nullptr);

 private:
  LoopVerificationOptions options_;
  WindowCache windows_;
};

}  // namespace pangea

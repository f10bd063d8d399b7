#pragma once

// From a candidate pair of keyframes to a verification result: the geometry that inter_map_ba and
// fusion share (the paper, section IV.D).
//
// In: the windows of keyframes up to the match (m) and up to the query (c), and the candidate's
// matched corners. Out: a Constraint between the two bodies, accepted with its covariance or
// refused with the reason. The same input gives the same verification result. Not thread safe.

#include <algorithm>

#include "loop_verification/steps/steps.h"
#include "loop_verification/window_cache.h"

namespace pangea {

class Aligner {
 public:
  // Keyframes a verification result depends on: that many up to each of the two.
  static constexpr int kNumKeyframes = std::max(kMaxWindowKeyframes, kVisibilityKeyframes);

  explicit Aligner(LoopVerificationOptions options) : options_(options) {}

  // kNumKeyframes up to the match and to the query, or fewer where their map begins.
  Constraint Align(const CandidateKeyframes& keyframes, const PlaceCandidate& candidate,
                   const LoopVerificationGate& gate, LoopVerificationReport* report = nullptr);

 private:
  LoopVerificationOptions options_;
  WindowCache windows_;
};

}  // namespace pangea

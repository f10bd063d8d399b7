#pragma once

// The first pose: PnP of the candidate's matched corners and the nearest descriptors.

#include "loop_verification/steps/verification.h"

namespace pangea {

struct FirstGuessOptions {
  // Matching without a prediction.
  int first_max_hamming = kAlikeHamming;
  double first_max_ratio = 0.85;
  int min_pnp_inliers = 6;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("first_max_hamming", &first_max_hamming, {0, kDescriptorBits}, "bits",
                "between descriptors matched without a prediction");
    archive.Add("first_max_ratio", &first_max_ratio, {0.01, 1}, "",
                "best to second-best Hamming distance there");
    archive.Add("min_pnp_inliers", &min_pnp_inliers, {3, 10000}, "", "of PnP");
  }
};

std::string GuessPose(const FirstGuessOptions& options, Verification* verification);

}  // namespace pangea

#pragma once

// The first pose: PnP on the candidate's matched corners and on nearest descriptors.

#include "loop_verification/steps/verification.h"

namespace pangea {

struct FirstGuessOptions {
  int min_pnp_inliers = 6;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("min_pnp_inliers", &min_pnp_inliers, {3, 10000}, "", "of PnP");
  }
};

std::string GuessPose(const FirstGuessOptions& options, Verification* verification);

}  // namespace pangea

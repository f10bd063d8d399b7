#pragma once

// All that a candidate must pass, in this order, and the options of all. The cheap steps come
// first: a bad candidate dies in the first two.
//
// Each step reads and writes the Verification, and returns why it refuses, or an empty string. A
// new one is a function with an options struct of its own, and its lines here. What it measures by
// AtLeast and AtMost, `pangea-log explain` shows.

#include <string_view>

#include "loop_verification/steps/acceptance.h"
#include "loop_verification/steps/first_guess.h"
#include "loop_verification/steps/gravity.h"
#include "loop_verification/steps/views.h"
#include "loop_verification/steps/visibility_check.h"

namespace pangea {

// The steps' options side by side: on disk and in captures all keys stand at one level.
struct LoopVerificationOptions : CommonStepOptions,
                                 FirstGuessOptions,
                                 ViewOptions,
                                 GravityOptions,
                                 VisibilityOptions,
                                 InlierOptions,
                                 CertaintyOptions,
                                 HalvesOptions {
  template <typename Archive>
  void Visit(Archive& archive) {
    CommonStepOptions::Visit(archive);
    FirstGuessOptions::Visit(archive);
    ViewOptions::Visit(archive);
    GravityOptions::Visit(archive);
    VisibilityOptions::Visit(archive);
    InlierOptions::Visit(archive);
    CertaintyOptions::Visit(archive);
    HalvesOptions::Visit(archive);
  }
};

struct VerificationStep {
  std::string_view name;
  std::string (*run)(const LoopVerificationOptions& options, Verification* verification);
};

// A step that sees only its own options.
template <auto kStep>
std::string Run(const LoopVerificationOptions& options, Verification* verification) {
  return kStep(options, verification);
}

inline constexpr VerificationStep kVerificationSteps[] = {
    {"PnP", Run<GuessPose>},
    {"views", Run<CheckViews>},
    {"gate of the kind", Run<CheckGate>},
    {"visibility in the two keyframes", Run<CheckVisibility>},
    {"joint bundle adjustment", Run<Optimise>},
    {"gravity", Run<CheckGravity>},
    {"views of the refined guess", Run<CheckViews>},
    {"gate of the kind, adjusted", Run<CheckGate>},
    {"inliers", Run<CheckInliers>},
    {"certainty", Run<CheckCertainty>},
    {"visibility along the way", Run<CheckWiderVisibility>},
    {"halves of the view", Run<CheckHalves>},
};

}  // namespace pangea

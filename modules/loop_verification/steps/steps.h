#pragma once

// The list of steps that a candidate must pass, in this order, and their options. Cheap steps come
// first: most bad candidates are refused by the first two.
//
// Each step reads and writes the Verification, and returns the reason of a refusal, or an empty
// string. To add a step, write a function with its own options struct, and list both here.
// `pangea-log explain` shows the values that a step compares by AtLeast and AtMost.

#include <string_view>

#include "loop_verification/steps/acceptance.h"
#include "loop_verification/steps/first_guess.h"
#include "loop_verification/steps/gravity.h"
#include "loop_verification/steps/tags.h"
#include "loop_verification/steps/views.h"
#include "loop_verification/steps/visibility_check.h"

namespace pangea {

// The options of all steps; in files and recorded sessions, all keys are on one level.
struct LoopVerificationOptions : CommonStepOptions,
                                 FirstGuessOptions,
                                 ViewOptions,
                                 GravityOptions,
                                 VisibilityOptions,
                                 InlierOptions,
                                 CertaintyOptions,
                                 HalvesOptions,
                                 TagOptions {
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
    TagOptions::Visit(archive);
  }
};

struct VerificationStep {
  std::string_view name;
  std::string (*run)(const LoopVerificationOptions& options, Verification* verification);
};

// Adapts a step that takes only its own options.
template <auto kStep>
std::string Run(const LoopVerificationOptions& options, Verification* verification) {
  return kStep(options, verification);
}

inline constexpr VerificationStep kVerificationSteps[] = {
    {"PnP", Run<GuessPose>},
    {"views", Run<CheckViews>},
    {"gate of the kind", Run<CheckDrift>},
    {"visibility in the two keyframes", Run<CheckVisibility>},
    {"joint bundle adjustment", Run<Optimise>},
    {"gravity", Run<CheckGravity>},
    {"views, adjusted", Run<CheckViews>},
    {"gate of the kind, adjusted", Run<CheckDrift>},
    {"inliers", Run<CheckInliers>},
    {"certainty", Run<CheckCertainty>},
    {"other tags", Run<CheckOtherTags>},
    {"visibility along the way", Run<CheckWiderVisibility>},
    {"halves of the view", Run<CheckHalves>},
};

// Of a candidate by a tag that both keyframes see: no other landmark is used.
inline constexpr VerificationStep kTagSteps[] = {
    {"tags", Run<AlignTags>},
    {"gate of the kind", Run<CheckDrift>},
    {"gravity", Run<CheckGravity>},
    {"certainty", Run<CheckTagCertainty>},
    {"other tags", Run<CheckOtherTags>},
};

}  // namespace pangea

#pragma once

// Aligns two windows by the tags that both see, without any other landmark.
//
// Each view of a tag has two poses that nearly fit. All combinations are tried, for several sizes
// if the tag's size is not known; the best one must fit clearly better than every other alignment.

#include <optional>
#include <string>

#include "core/keyframe_store.h"
#include "core/tags/tag_sizes.h"
#include "loop_verification/tags/tag_problem.h"

namespace pangea {

struct TagAlignment {
  Rigid3 T_m_c;                                // between the window frames (window.h)
  Rigid3 T_Km_Kc;                              // between the newest keyframes' bodies
  Matrix6d covariance = Matrix6d::Identity();  // of T_Km_Kc, in Km's body frame
  int num_corners = 0;
  double rms_px = 0;
  double chi2_per_dof = 0;
  // chi2 of the next best alignment, less that of the best one; nothing: no other one was found.
  std::optional<double> chi2_to_rival;
};

// `m`, `c`: up to ten keyframes of each side. Nothing if they see no common tag, or no alignment
// is found.
std::optional<TagAlignment> AlignByTags(const KeyframeWindow& m, const KeyframeWindow& c,
                                        const TagSizes& sizes);

}  // namespace pangea

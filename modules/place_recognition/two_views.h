#pragma once

// Do two keyframes show the same place? Corners matched by descriptor, then one relative pose has
// to explain them (epipolar_check.h). Deterministic.

#include <optional>

#include "core/matching.h"
#include "place_recognition/epipolar_check.h"
#include "place_recognition/stored_keyframes.h"

namespace pangea {

struct TwoViewResult {
  int num_matches = 0;                     // corners that have a ray
  std::optional<EpipolarResult> epipolar;  // none with fewer matches than inliers are asked for

  bool accepted() const { return epipolar && epipolar->accepted; }
};

TwoViewResult CheckTwoViews(const RecognisedKeyframe& query, const RecognisedKeyframe& other,
                            const MatchingOptions& matching, const EpipolarOptions& epipolar);

}  // namespace pangea

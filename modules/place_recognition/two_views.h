#pragma once

// Do two keyframes show the same place? Corners matched by descriptor, then one relative pose has
// to explain them (epipolar_check.h). Deterministic.

#include <optional>
#include <vector>

#include "core/matching.h"
#include "place_recognition/epipolar_check.h"
#include "place_recognition/stored_keyframes.h"

namespace pangea {

struct TwoViewResult {
  std::vector<CornerMatch> pairs;          // PairsWithin what was asked for
  int num_matches = 0;                     // corners that have a ray
  std::optional<EpipolarResult> epipolar;  // none with fewer matches than inliers are asked for

  bool accepted() const { return epipolar && epipolar->accepted; }
};

// `pairs_up_to`: the distance of pairs that the caller wants, beyond what matching takes.
TwoViewResult CheckTwoViews(const RecognisedKeyframe& query, const RecognisedKeyframe& other,
                            int pairs_up_to = 0);

}  // namespace pangea

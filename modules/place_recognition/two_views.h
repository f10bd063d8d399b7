#pragma once

// Checks whether two keyframes show the same place: matches corners by descriptor, then tests
// whether one relative pose explains them (epipolar_check.h). Deterministic.

#include <optional>
#include <vector>

#include "core/matching.h"
#include "place_recognition/epipolar_check.h"
#include "place_recognition/stored_keyframes.h"

namespace pangea {

struct TwoViewResult {
  std::vector<CornerMatch> pairs;          // by PairsWithin, see `pairs_up_to`
  int num_matches = 0;                     // matches whose corners have rays
  std::optional<EpipolarResult> epipolar;  // empty with fewer matches than kMinEpipolarInliers

  bool accepted() const { return epipolar && epipolar->accepted; }
};

// `pairs_up_to`: `pairs` also contains pairs up to this Hamming distance, if matching itself does
// not need them.
TwoViewResult CheckTwoViews(const RecognisedKeyframe& query, const RecognisedKeyframe& other,
                            int pairs_up_to = 0);

}  // namespace pangea

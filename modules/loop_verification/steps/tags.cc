#include "loop_verification/steps/tags.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>

#include "core/tags/tag_place.h"
#include "loop_verification/tags/tag_alignment.h"
#include "loop_verification/tags/tag_places.h"

namespace pangea {
namespace {

// The newest keyframes: as many as a window has at most.
KeyframeWindow Newest(const KeyframeWindow& frames) {
  const size_t count = std::min<size_t>(frames.size(), kMaxWindowKeyframes);
  return {frames.end() - static_cast<std::ptrdiff_t>(count), frames.end()};
}

// Whether lengths between the two keyframes can be metres.
bool SomeLengthIsKnown(const Verification& v, const TagSizes& sizes) {
  const Keyframe& c = v.keyframes.c.back()->keyframe();
  return v.candidate.match.map != c.id.map || UnknownScaleSigma(c.scale_sigma) == 0 ||
         std::ranges::any_of(
             c.tags, [&](const TagObservation& seen) { return sizes.Of(seen.tag).has_value(); });
}

}  // namespace

std::string AlignTags(const TagOptions& options, Verification* verification) {
  Verification& v = *verification;
  const TagSizes sizes(options.tags);
  if (!SomeLengthIsKnown(v, sizes)) {
    return "neither the map's scale nor the tag's size is known";
  }
  const auto aligned = AlignByTags(Newest(v.keyframes.m), Newest(v.keyframes.c), sizes);
  if (!aligned) {
    return "no alignment by a common tag";
  }
  JointBaResult& result = v.ba.emplace();
  result.T_m_c = aligned->T_m_c;
  result.T_Km_Kc = aligned->T_Km_Kc;
  result.covariance = aligned->covariance;
  result.num_inlier_observations = aligned->num_corners;
  result.rms_px = aligned->rms_px;
  if (!v.AtMost("max_tag_chi2", aligned->chi2_per_dof, options.max_tag_chi2)) {
    return "corners of the tag do not fit";
  }
  const bool clear = !aligned->chi2_to_rival ||
                     v.AtLeast("min_tag_margin", *aligned->chi2_to_rival, options.min_tag_margin);
  return clear ? "" : "the tag's pose is ambiguous";
}

std::string CheckTagCertainty(const TagOptions& options, Verification* verification) {
  Verification& v = *verification;
  const Matrix6d& covariance = v.ba->covariance;
  const bool placed = v.AtMost("max_tag_sigma_m", LargestSigma(covariance.topLeftCorner<3, 3>()),
                               options.max_tag_sigma_m);
  const bool rotated =
      v.AtMost("max_tag_sigma_rad", LargestSigma(covariance.bottomRightCorner<3, 3>()),
               options.max_tag_sigma_rad);
  return placed && rotated ? "" : "too uncertain";
}

std::string CheckOtherTags(const TagOptions& options, Verification* verification) {
  constexpr double kApart_m = 0.05;  // two tags on one wall are not nearer
  // The second largest is across the sight: there no two tags are that near.
  constexpr double kMaxSigma_m = 2, kMaxSecondSigma_m = 0.15;
  constexpr double kMinChi2 = 9;  // 97 %, 3 degrees of freedom
  Verification& v = *verification;
  const TagSizes sizes(options.tags);
  const auto of_m = PlaceTags(Newest(v.keyframes.m), sizes);
  const auto of_c = PlaceTags(Newest(v.keyframes.c), sizes);
  const Eigen::Matrix3d R_m_c = v.T_m_c().R();
  for (const auto& [tag_m, place_m] : of_m) {
    for (const auto& [tag_c, place_c] : of_c) {
      // A side that sees both tells itself that they are neighbours.
      if (!place_m || !place_c || of_m.contains(tag_c) || of_c.contains(tag_m)) {
        continue;
      }
      const Eigen::Vector3d apart = v.T_m_c() * place_c->p_w - place_m->p_w;
      const Eigen::Matrix3d covariance = place_m->covariance +
                                         R_m_c * place_c->covariance * R_m_c.transpose() +
                                         kApart_m * kApart_m * Eigen::Matrix3d::Identity();
      const Eigen::Vector3d sigmas =
          Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues().cwiseSqrt();
      if (sigmas[2] <= kMaxSigma_m && sigmas[1] <= kMaxSecondSigma_m &&
          !v.AtLeast("chi2 between different tags", apart.dot(covariance.inverse() * apart),
                     kMinChi2)) {
        return kDifferentTags;
      }
    }
  }
  return "";
}

}  // namespace pangea

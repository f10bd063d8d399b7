#include "loop_verification/steps/acceptance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "loop_verification/correspondences/epipolar_filter.h"
#include "loop_verification/steps/visibility_check.h"

namespace pangea {
namespace {

double PositionSigma(const Matrix6d& covariance) {
  return LargestSigma(covariance.topLeftCorner<3, 3>());
}

// If the rest of the view leaves a direction undetermined, a single near point determines it, right
// or wrong: it was searched near its predicted position, so whatever was found there fits. So in
// the worst direction no landmark may contribute more information than all others together.
bool OneSaysMost(Verification* v) {
  return !v->AtMost("sigma_m without 1 landmark", PositionSigma(v->ba->covariance_without_one),
                    std::numbers::sqrt2 * PositionSigma(v->ba->covariance));
}

// One wrong match can be detected, but two or three near ones may agree. They were searched near
// their predicted positions, so they fit, but their descriptors are only vaguely similar: the sure
// landmarks must meet the limit without them.
bool HangsOnVagueMatches(Verification* v, double max_sigma_m) {
  constexpr double kNotFixed_m = 1e3;
  const auto& covariance = v->ba->covariance_of_sure;
  return !v->AtMost("max_sigma_m, sure matches",
                    covariance ? PositionSigma(*covariance) : kNotFixed_m, max_sigma_m);
}

// Number of distinct inlier landmarks, and of the image cells that they occupy in one of the two
// keyframes.
struct InlierCounts {
  size_t landmarks = 0;
  size_t cells = 0;
};

InlierCounts CountInliers(const Verification& v) {
  std::set<std::pair<Direction, int>> landmarks;
  std::map<Direction, std::set<int>> cells;
  for (const PointMatch& match : v.InlierMatches()) {
    landmarks.emplace(match.direction, match.landmark);
    const Window& observer = v.windows.Observer(match.direction);
    if (match.observed.frame == observer.newest()) {
      cells[match.direction].insert(ImageCell(
          observer.newest_keyframe().camera, observer.corner(match.observed).pixel.cast<double>()));
    }
  }
  InlierCounts counts{landmarks.size(), 0};
  for (const auto& [direction, occupied] : cells) {
    counts.cells = std::max(counts.cells, occupied.size());
  }
  return counts;
}

}  // namespace

std::string Optimise(const InlierOptions& options, Verification* verification) {
  constexpr double kMaxEpipolarError_px = 4;
  constexpr int kMinEpipolarPairs = 16;
  Verification& v = *verification;
  for (const Direction direction : kBothDirections) {
    for (int frame = 0; frame <= v.windows.Observer(direction).newest(); ++frame) {
      const SearchResult result = SearchByProjection(v.windows, direction, frame, v.pose);
      v.matches.insert(v.matches.end(), result.matches.begin(), result.matches.end());
    }
  }
  v.matches = FilterByFundamental(v.windows, Agreeing(v.windows, v.matches), kMaxEpipolarError_px,
                                  kMinEpipolarPairs);
  if (static_cast<int>(v.matches.size()) < options.min_inliers) {
    return "too few points found by projection";
  }
  v.ba = SolveJointBa(v.windows, v.matches, v.pose.T_m_c, v.options.ba);
  return v.ba ? "" : "the window optimisation failed";
}

std::string CheckInliers(const InlierOptions& options, Verification* verification) {
  Verification& v = *verification;
  const InlierCounts counts = CountInliers(v);
  const bool enough =
      v.AtLeast("min_inliers", static_cast<double>(counts.landmarks), options.min_inliers);
  const bool most = v.AtLeast("min_inlier_ratio", v.inlier_ratio(), options.min_inlier_ratio);
  const bool spread = v.AtLeast("min_occupied_cells", static_cast<double>(counts.cells),
                                options.min_occupied_cells);
  if (!enough) {
    return "too few inliers";
  }
  if (!most) {
    return "too many outliers";
  }
  return spread ? "" : "inliers too close together";
}

std::string CheckCertainty(const CertaintyOptions& options, Verification* verification) {
  Verification& v = *verification;
  const Matrix6d& covariance = v.ba->covariance;
  const bool placed = v.AtMost("max_sigma_m", PositionSigma(covariance), options.max_sigma_m);
  const bool rotated = v.AtMost("max_sigma_rad", LargestSigma(covariance.bottomRightCorner<3, 3>()),
                                options.max_sigma_rad);
  if (!placed || !rotated) {
    return "too uncertain";
  }
  if (OneSaysMost(verification)) {
    return "hangs on one landmark";
  }
  return HangsOnVagueMatches(verification, options.max_sigma_m) ? "hangs on vague matches" : "";
}

std::string CheckHalves(const HalvesOptions& options, Verification* verification) {
  Verification& v = *verification;
  const auto halves = HalvesOfView(v.windows, v.InlierMatches(), v.ba->T_m_c);
  const auto solve = [&v](const std::vector<PointMatch>& half) {
    return SolveJointBa(v.windows, half, v.ba->T_m_c, v.options.ba,
                        JointBaCovariances::kOfAllLandmarks);
  };
  const auto left = solve(halves[0]);
  const auto right = solve(halves[1]);
  if (!left || !right) {
    return "half of the view gives no pose";
  }
  const Vector6d difference = left->T_Km_Kc.Minus(right->T_Km_Kc);
  const Matrix6d covariance = left->covariance + right->covariance;
  return v.AtMost("max_halves_chi2", difference.dot(covariance.ldlt().solve(difference)),
                  options.max_halves_chi2)
             ? ""
             : "the halves of the view disagree";
}

}  // namespace pangea

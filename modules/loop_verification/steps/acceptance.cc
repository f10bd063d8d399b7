#include "loop_verification/steps/acceptance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "loop_verification/correspondences/epipolar_filter.h"
#include "loop_verification/steps/visibility_check.h"

namespace pangea {
namespace {

double PositionSigma(const Matrix6d& covariance) {
  return LargestSigma(covariance.topLeftCorner<3, 3>());
}

// Where the rest of the view leaves a direction open, one near point decides it, right or wrong:
// it was looked for where the guess had it, and whatever was found there fits. So of what is
// known in the worst direction no landmark may say more than all others together.
bool OneSaysMost(const JointBaResult& ba, LoopVerificationReport* report) {
  const double sigma_m = PositionSigma(ba.covariance);
  report->sigma_without_one_m = PositionSigma(ba.covariance_without_one);
  return report->sigma_without_one_m * report->sigma_without_one_m > 2 * sigma_m * sigma_m;
}

// One wrong match can be found out; two or three together, all near, agree. They are looked for
// where the guess has them, so they fit, but they look alike only vaguely: what is surely the
// same must keep the promise without them.
bool HangsOnVagueMatches(const JointBaResult& ba, double max_sigma_m,
                         LoopVerificationReport* report) {
  constexpr double kNotFixed_m = 1e3;
  report->sigma_of_sure_m =
      ba.covariance_of_sure ? PositionSigma(*ba.covariance_of_sure) : kNotFixed_m;
  return report->sigma_of_sure_m > max_sigma_m;
}

// Of the landmarks, and of the cells that they occupy in one of the two keyframes.
void CountInliers(Verification* v) {
  std::set<std::pair<Direction, int>> landmarks;
  std::map<Direction, std::set<int>> cells;
  for (const PointMatch& match : v->InlierMatches()) {
    landmarks.emplace(match.direction, match.landmark);
    const Window& observer = v->windows.Observer(match.direction);
    if (match.observed.frame == observer.newest()) {
      cells[match.direction].insert(ImageCell(
          observer.newest_keyframe().camera, observer.corner(match.observed).pixel.cast<double>()));
    }
  }
  v->report.landmarks = static_cast<int>(landmarks.size());
  for (const auto& [direction, occupied] : cells) {
    v->report.cells = std::max(v->report.cells, static_cast<int>(occupied.size()));
  }
}

}  // namespace

std::string Optimise(const InlierOptions& options, Verification* verification) {
  constexpr double kMaxEpipolarError_px = 4;
  constexpr int kMinEpipolarPairs = 16;
  Verification& v = *verification;
  for (const Direction direction : kBothDirections) {
    for (int frame = 0; frame <= v.windows.Observer(direction).newest(); ++frame) {
      const SearchResult result =
          SearchByProjection(v.windows, direction, frame, v.pose, v.options.search);
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
  CountInliers(verification);
  if (verification->report.landmarks < options.min_inliers) {
    return "too few inliers";
  }
  if (verification->inlier_ratio() < options.min_inlier_ratio) {
    return "too many outliers";
  }
  return verification->report.cells < options.min_occupied_cells ? "inliers too close together"
                                                                 : "";
}

std::string CheckCertainty(const CertaintyOptions& options, Verification* verification) {
  const JointBaResult& ba = *verification->ba;
  if (PositionSigma(ba.covariance) > options.max_sigma_m ||
      LargestSigma(ba.covariance.bottomRightCorner<3, 3>()) > options.max_sigma_rad) {
    return "too uncertain";
  }
  if (OneSaysMost(ba, &verification->report)) {
    return "hangs on one landmark";
  }
  return HangsOnVagueMatches(ba, options.max_sigma_m, &verification->report)
             ? "hangs on vague matches"
             : "";
}

std::string CheckHalves(const HalvesOptions& options, Verification* verification) {
  Verification& v = *verification;
  const auto halves = HalvesOfView(v.windows, v.InlierMatches(), v.ba->T_m_c);
  const auto left = SolveJointBa(v.windows, halves[0], v.ba->T_m_c, v.options.ba);
  const auto right = SolveJointBa(v.windows, halves[1], v.ba->T_m_c, v.options.ba);
  if (!left || !right) {
    return "half of the view gives no pose";
  }
  const Vector6d difference = left->T_Km_Kc.Minus(right->T_Km_Kc);
  const Matrix6d covariance = left->covariance + right->covariance;
  v.report.halves_chi2 = difference.dot(covariance.ldlt().solve(difference));
  return v.report.halves_chi2 > options.max_halves_chi2 ? "the halves of the view disagree" : "";
}

}  // namespace pangea

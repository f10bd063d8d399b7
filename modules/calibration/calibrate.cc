#include "calibration/calibrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>

#include "calibration/frame_pairs.h"
#include "calibration/priors.h"
#include "calibration/search.h"
#include "calibration/solver.h"
#include "core/axis_aligned.h"
#include "core/rigid3.h"

namespace pangea::calibration {
namespace {

constexpr double kFieldsOfView[] = {52 * kDegree, 65 * kDegree, 80 * kDegree};
constexpr double kOtherRotation = 0.5;  // rad
constexpr CameraModel::Kind kLenses[] = {CameraModel::Kind::kRadtan,
                                         CameraModel::Kind::kEquidistant};

// Largest gap within pairs for the search: errors of unknown parameters grow with time.
constexpr double kSearchGap_s = 0.12;
constexpr double kVelocityChange = 1;  // within a pair (epipolar.h)
constexpr size_t kMaxRefined = 9;      // hypotheses refined on a part of the pairs
constexpr size_t kChooseOnEvery = 3;   // that part: every third pair
constexpr double kMinSeconds = 8;      // of pairs
// A result beyond these limits is refused.
constexpr double kMaxSigmaRotation = 0.06;  // rad
constexpr double kMaxSigmaLogFocal = 0.05;
constexpr double kMaxSigmaTimeOffset_s = 0.01;
constexpr double kMaxSigma_px = 2.5;
constexpr double kMinFieldOfView = 0.7, kMaxFieldOfView = 2.3;  // rad
constexpr double kMinCostRatio = 2;  // cost of the next best rotation / cost of the best
// A rotation agrees with the given one if the difference is within the 99.9 % bound (chi-squared, 3
// degrees of freedom: 4.03 sigma) of the errors of both: 27 degrees. Wrong axes differ by 90
// degrees at least.
const double kMaxOffGiven = 4.03 * std::hypot(kSigmaGivenRotation, kMaxSigmaRotation);
// The given rotation fits worse than another one if SigmasWorse exceeds this: 99 %. The fewest
// blocks possible can reach it (if all kMinSeconds blocks agree: 2.52).
constexpr double kMaxSigmasWorse = 2.33;

// Solves first without the lens: focal length and distortion would diverge together while the
// rotation is inaccurate.
Solution Refined(const Solver& solver, const Hypothesis& hypothesis, const Prior& prior) {
  Prior first = prior;
  first.sigma.tail<kSize - kLogFocal>().setZero();
  const Solution roughly = solver.Solve(hypothesis.parameters, first, kRoughlyConverged);
  return solver.Solve(roughly.parameters, prior);
}

// Pairs that inertial samples cover for any time offset in the search range.
std::vector<FramePair> Pairs(const Input& input, double max_gap_s, int64_t origin) {
  std::vector<FramePair> pairs = MakePairs(input.frames, origin, max_gap_s);
  const OrientationCurve curve(input.imu, origin, Eigen::Vector3d::Zero());
  constexpr double kMargin_s = kMaxOffset_s + 2 * kSigmaTimeOffset_s;
  std::erase_if(pairs, [&](const FramePair& pair) {
    return !curve.Covers(pair.a_s - kMargin_s, pair.b_s + kMargin_s);
  });
  return pairs;
}

// Half of the difference between the results of the recording's two halves. It shows errors that
// the residuals do not, such as a changing focus or delay.
Tangent HalfDifference(const Input& input, std::span<const FramePair> pairs, int64_t origin,
                       const Solution& solution, const Prior& prior) {
  const size_t middle = pairs.size() / 2;
  const auto part = [&](std::span<const FramePair> half) {
    return Solver(half, input.imu, origin, kVelocityChange).Solve(solution.parameters, prior);
  };
  const Parameters first = part(pairs.first(middle)).parameters;
  const Parameters second = part(pairs.subspan(middle)).parameters;
  return 0.5 * first.Minus(second);
}

// Adds errors that the residuals cannot show. A gyroscope with too small a scale gives too large a
// focal length, by the same factor.
void AddFloors(const Input& input, Result& result) {
  const ImuNoise& noise = input.imu_noise;
  const auto add = [&result](int row, double sigma) {
    result.covariance(row, row) += sigma * sigma;
  };
  for (int axis = 0; axis < 3; ++axis) {
    add(kRotation + axis, noise.axes_sigma);
  }
  // Error of modelling a lens with two coefficients.
  constexpr double kLensSigma = 0.001;
  add(kDistortion, kLensSigma);
  add(kDistortion + 1, kLensSigma);
  add(kLogFocal, std::max(input.least_gyro_scale_sigma, noise.gyro_scale_sigma));
  result.sigma = result.covariance.diagonal().cwiseSqrt();
}

// Standard deviation of the time offset due to changing intervals between images.
double TimeOffsetSpread(std::span<const FramePair> pairs, double interval_share) {
  double squared = 0;
  for (const FramePair& pair : pairs) {
    squared += pair.a_excess_s * pair.a_excess_s;
  }
  return std::abs(interval_share) * std::sqrt(squared / static_cast<double>(pairs.size()));
}

std::string Refusal(const Result& result) {
  const Tangent& sigma = result.sigma;
  const double offset_s = std::abs(result.parameters.MiddleRowOffset_s());
  const double field = FieldOfView(result.parameters.camera);
  if (offset_s > kMaxOffset_s || field < kMinFieldOfView || field > kMaxFieldOfView) {
    return fmt::format(
        "what fits best is no phone's: a field of view of {:.0f} degrees, a time offset of {:.0f} "
        "ms: rotate more, about all three axes",
        field / kDegree, 1e3 * offset_s);
  }
  if (result.sigma_px > kMaxSigma_px) {
    return fmt::format(
        "points are {:.1f} px off what the gyroscope says (at most {} are plausible): stamps, "
        "units or axes of the IMU are wrong, or much in the image moves by itself",
        result.sigma_px, kMaxSigma_px);
  }
  if (result.next_cost > 0 && result.next_cost < kMinCostRatio) {
    return fmt::format(
        "another rotation of the camera fits as well ({:.1f} % worse): rotate more, "
        "about all three axes",
        100 * (result.next_cost - 1));
  }
  const double rotation = sigma.segment<3>(kRotation).maxCoeff();
  if (rotation > kMaxSigmaRotation) {
    return fmt::format(
        "the rotation camera to IMU is known to {:.1f} degrees only: rotate more, "
        "about at least two axes",
        rotation / kDegree);
  }
  if (sigma[kLogFocal] > kMaxSigmaLogFocal) {
    return fmt::format("the focal length is known to {:.0f} % only: rotate more, to and fro",
                       100 * sigma[kLogFocal]);
  }
  if (sigma[kTimeOffset] > kMaxSigmaTimeOffset_s) {
    return fmt::format(
        "the time offset is known to {:.0f} ms only: begin and end rotations briskly",
        1e3 * sigma[kTimeOffset]);
  }
  return "";
}

void Fill(const Solution& solution, Result& result) {
  result.parameters = solution.parameters;
  // For a global shutter the estimate may be slightly negative.
  CameraModel& camera = result.parameters.camera;
  if (camera.readout_s < 0) {
    camera.time_offset_s += 0.5 * camera.readout_s;
    camera.readout_s = 0;
  }
  result.covariance = solution.covariance;
  result.sigma_px = solution.sigma_px;
  result.inlier_share = solution.inlier_share;
}

std::vector<FramePair> EveryNth(std::span<const FramePair> pairs) {
  std::vector<FramePair> some;
  for (size_t i = 0; i < pairs.size(); i += kChooseOnEvery) {
    some.push_back(pairs[i]);
  }
  return some;
}

// The hypothesis that best explains a part of the pairs.
struct Choice {
  Hypothesis best;
  double next_cost = 0;  // cost of the best other rotation / cost of the best; 0: only one
};

// At low rates even the next image is further away than kSearchGap_s.
std::vector<FramePair> SearchPairs(const Input& input, std::span<const FramePair> pairs,
                                   int64_t origin) {
  const double interval_s =
      1e-6 * static_cast<double>(input.frames.back().utime - input.frames.front().utime) /
      static_cast<double>(std::max<size_t>(1, input.frames.size() - 1));
  const double gap_s = std::clamp(1.5 * interval_s, kSearchGap_s, kMaxGap_s);
  const std::vector<FramePair> near = Pairs(input, gap_s, origin);
  return WithMostMotion(near.empty() ? std::vector(pairs.begin(), pairs.end()) : near);
}

Choice ChooseRotation(const Input& input, std::span<const FramePair> pairs, int64_t origin) {
  const std::vector<Eigen::Quaterniond> rotations =
      input.q_body_cam ? std::vector{*input.q_body_cam} : AxisAlignedRotations();
  const std::vector<double> fields =
      input.field_of_view ? std::vector{*input.field_of_view}
                          : std::vector<double>(std::begin(kFieldsOfView), std::end(kFieldsOfView));
  const std::vector<FramePair> searched = SearchPairs(input, pairs, origin);
  std::vector<Hypothesis> found =
      Search(searched, input.imu, origin, NominalCamera(input, CameraModel::Kind::kRadtan),
             rotations, fields);
  // An unknown gyro bias may hide the right hypothesis, so each is refined a little before most are
  // dropped.
  const Solver roughly(searched, input.imu, origin, kSearchVelocityChange);
  for (Hypothesis& hypothesis : found) {
    Prior first = PriorOf(input, hypothesis.parameters);
    first.sigma.tail<kSize - kLogFocal>().setZero();
    const Solution solution = roughly.Solve(hypothesis.parameters, first, kRoughlyConverged);
    hypothesis = {solution.parameters, solution.cost};
  }
  SortByCost(&found);
  found.resize(std::min(found.size(), kMaxRefined));
  const std::vector<FramePair> some = EveryNth(pairs);
  const Solver solver(some, input.imu, origin, kSearchVelocityChange);
  for (Hypothesis& hypothesis : found) {
    const Solution solution = Refined(solver, hypothesis, PriorOf(input, hypothesis.parameters));
    hypothesis = {solution.parameters, solution.cost};
  }
  SortByCost(&found);
  Choice choice{found.front(), 0};
  for (const Hypothesis& other : found) {
    const double apart = other.parameters.camera.T_body_cam.q.angularDistance(
        found.front().parameters.camera.T_body_cam.q);
    if (apart > kOtherRotation) {
      choice.next_cost = other.cost / found.front().cost;
      break;
    }
  }
  return choice;
}

double AngleBetween(const Parameters& a, const Eigen::Quaterniond& q_body_cam) {
  return a.camera.T_body_cam.q.angularDistance(q_body_cam);
}

// Significance with which `worse` fits worse than `better`, in standard deviations: signed-rank
// test on the cost differences of blocks of time, which are independent (Wilcoxon, Biometrics
// 1945). The sizes of the differences vary with the motion, so their mean is not meaningful.
double SigmasWorse(const Input& input, std::span<const FramePair> pairs, int64_t origin,
                   const Parameters& worse, const Parameters& better) {
  const std::vector<FramePair> some = EveryNth(pairs);
  const Solver solver(some, input.imu, origin, kSearchVelocityChange);
  const std::vector<double> costs = solver.Costs(worse, 1), lower = solver.Costs(better, 1);
  std::map<int64_t, double> blocks;
  for (size_t i = 0; i < some.size(); ++i) {
    blocks[static_cast<int64_t>(std::floor(some[i].a_s / kBlock_s))] += costs[i] - lower[i];
  }
  std::vector<double> differences;
  for (const auto& [block, difference] : blocks) {
    differences.push_back(difference);
  }
  std::sort(differences.begin(), differences.end(),
            [](double a, double b) { return std::abs(a) < std::abs(b); });
  double ranks = 0;
  for (size_t i = 0; i < differences.size(); ++i) {
    ranks += differences[i] > 0 ? static_cast<double>(i + 1) : 0;
  }
  const auto n = static_cast<double>(differences.size());
  return (ranks - n * (n + 1) / 4) / std::sqrt(n * (n + 1) * (2 * n + 1) / 24);
}

// A choice from all rotations that fits better than the given rotation, if there is one: the best
// rotation disagrees with the given one, and the result of the given one either disagrees too or
// fits worse.
std::optional<Choice> BetterThanGiven(const Input& input, std::span<const FramePair> pairs,
                                      int64_t origin, const Parameters& with_given) {
  Input free = input;
  free.q_body_cam.reset();
  const Choice choice = ChooseRotation(free, pairs, origin);
  const Parameters& best = choice.best.parameters;
  if (AngleBetween(best, *input.q_body_cam) < kMaxOffGiven) {
    return std::nullopt;
  }
  if (AngleBetween(with_given, *input.q_body_cam) < kMaxOffGiven &&
      SigmasWorse(input, pairs, origin, with_given, best) < kMaxSigmasWorse) {
    return std::nullopt;
  }
  return choice;
}

void RefuseGiven(const Eigen::Quaterniond& given, const Choice& better, Result* result) {
  const Eigen::Quaterniond& q = better.best.parameters.camera.T_body_cam.q;
  result->refused =
      fmt::format("the camera's x, y, z do not point along the IMU's {} as given", AxesOf(given));
  if (better.next_cost > 0 && better.next_cost < kMinCostRatio) {
    result->refused += ", and the motion does not tell which do: rotate more, about all three axes";
    return;
  }
  result->better_q_body_cam = q;
  result->refused += fmt::format(": the points say {}, {:.0f} degrees from that", AxesOf(q),
                                 q.angularDistance(given) / kDegree);
}

// Solves with both lens models and returns the better solution.
Solution SolveAll(const Input& input, std::span<const FramePair> pairs, int64_t origin,
                  const Parameters& start) {
  const Solver solver(pairs, input.imu, origin, kVelocityChange);
  Solution best;
  best.cost = std::numeric_limits<double>::infinity();
  for (const CameraModel::Kind lens : kLenses) {
    Parameters mean = start;
    mean.camera.kind = lens;
    if (lens != start.camera.kind) {
      const double half_px = 0.5 * std::max(input.width, input.height);
      mean.camera.fx = mean.camera.fy =
          FocalOf(2 * std::atan(half_px / start.camera.fx), mean.camera);
    }
    mean.camera.distortion.setZero();
    const Solution solution = Refined(solver, {mean, 0}, PriorOf(input, mean));
    if (solution.cost < best.cost) {
      best = solution;
    }
  }
  const Tangent apart = HalfDifference(input, pairs, origin, best, PriorOf(input, best.parameters));
  for (int row = 0; row < kSize; ++row) {
    const double scale = std::max(1.0, std::abs(apart[row]) / std::sqrt(best.covariance(row, row)));
    best.covariance.row(row) *= scale;
    best.covariance.col(row) *= scale;
  }
  return best;
}

Coverage RoughCoverage(const Input& input, std::span<const FramePair> pairs) {
  Parameters roughly;
  roughly.camera.T_body_cam.q = input.q_body_cam.value_or(Eigen::Quaterniond::Identity());
  return CoverageOf(pairs, input.imu, input.frames.front().utime, roughly);
}

}  // namespace

Coverage RoughCoverage(const Input& input) {
  if (input.frames.empty() || input.imu.size() < 2) {
    return {};
  }
  return RoughCoverage(input, Pairs(input, kMaxGap_s, input.frames.front().utime));
}

Result Calibrate(const Input& input) {
  Result result;
  if (input.frames.empty() || input.imu.size() < 2) {
    result.refused = "there are no images or no inertial samples";
    return result;
  }
  const int64_t origin = input.frames.front().utime;
  result.image_rate_hz =
      static_cast<double>(input.frames.size()) /
      std::max(1e-3, 1e-6 * static_cast<double>(input.frames.back().utime - origin));
  const std::vector<FramePair> pairs = Pairs(input, kMaxGap_s, origin);
  result.coverage = RoughCoverage(input, pairs);
  if (result.coverage.seconds < kMinSeconds) {
    result.refused = fmt::format(
        "points could be followed for {:.1f} s, at least {:.0f} are needed: record longer, with "
        "more light or more to see",
        result.coverage.seconds, kMinSeconds);
    return result;
  }
  const Choice choice = ChooseRotation(input, pairs, origin);
  result.next_cost = choice.next_cost;
  if (input.q_body_cam && input.check_rotation) {
    if (const auto better = BetterThanGiven(input, pairs, origin, choice.best.parameters)) {
      RefuseGiven(*input.q_body_cam, *better, &result);
      return result;
    }
  }
  Fill(SolveAll(input, pairs, origin, choice.best.parameters), result);
  result.coverage = CoverageOf(pairs, input.imu, origin, result.parameters);
  AddFloors(input, result);
  result.time_offset_spread_s = TimeOffsetSpread(pairs, result.parameters.interval_share);
  result.refused = Refusal(result);
  return result;
}

}  // namespace pangea::calibration

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
#include "core/rigid3.h"

namespace pangea::calibration {
namespace {

constexpr double kFieldsOfView[] = {52 * kDegree, 65 * kDegree, 80 * kDegree};
constexpr double kOtherRotation = 0.5;  // rad
constexpr CameraModel::Kind kLenses[] = {CameraModel::Kind::kRadtan,
                                         CameraModel::Kind::kEquidistant};

// Of the pairs searched on: what is not yet known adds up over time.
constexpr double kSearchGap_s = 0.12;
constexpr double kVelocityChange = 1;  // within a pair (epipolar.h)
constexpr size_t kMaxRefined = 9;      // hypotheses, on a part of the pairs
constexpr size_t kChooseOnEvery = 3;   // that part
constexpr double kMinSeconds = 8;      // of pairs
// The result is refused beyond these.
constexpr double kMaxSigmaRotation = 0.06;  // rad
constexpr double kMaxSigmaLogFocal = 0.05;
constexpr double kMaxSigmaTimeOffset_s = 0.01;
constexpr double kMaxSigma_px = 2.5;
constexpr double kMinFieldOfView = 0.7, kMaxFieldOfView = 2.3;  // rad
constexpr double kMinCostRatio = 2;  // the next best rotation's over the best one's
// A rotation found is the given one if it is within the 99.9 % bound (chi squared, 3 degrees of
// freedom: 4.03 sigma) of the given one's error and of the largest error of a found one: 27
// degrees. Wrong axes are off by 90 at least.
const double kMaxOffGiven = 4.03 * std::hypot(kSigmaGivenRotation, kMaxSigmaRotation);
// The given rotation fits worse than another beyond this: 99 %, which the fewest blocks can reach
// (kMinSeconds of them all say so: 2.52).
constexpr double kMaxSigmasWorse = 2.33;

// First without the lens: focal length and distortion run away together while the rotation is
// rough.
Solution Refined(const Solver& solver, const Hypothesis& hypothesis, const Prior& prior) {
  Prior first = prior;
  first.sigma.tail<kSize - kLogFocal>().setZero();
  const Solution roughly = solver.Solve(hypothesis.parameters, first, kRoughlyConverged);
  return solver.Solve(roughly.parameters, prior);
}

// With inertial samples all around, wherever the clocks are.
std::vector<FramePair> Pairs(const Input& input, double max_gap_s, int64_t origin) {
  std::vector<FramePair> pairs = MakePairs(input.frames, origin, max_gap_s);
  const OrientationCurve curve(input.imu, origin, Eigen::Vector3d::Zero());
  constexpr double kMargin_s = kMaxOffset_s + 2 * kSigmaTimeOffset_s;
  std::erase_if(pairs, [&](const FramePair& pair) {
    return !curve.Covers(pair.a_s - kMargin_s, pair.b_s + kMargin_s);
  });
  return pairs;
}

// Half of what lies between the results of the recording's halves: what the residuals do not show,
// such as a focus or a delay that changes.
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

// A gyroscope that reads too little makes lenses too long, by the same share.
void AddFloors(const Input& input, Result& result) {
  const ImuNoise& noise = input.imu_noise;
  const auto add = [&result](int row, double sigma) {
    result.covariance(row, row) += sigma * sigma;
  };
  for (int axis = 0; axis < 3; ++axis) {
    add(kRotation + axis, noise.axes_sigma);
  }
  // What two coefficients leave of a lens.
  constexpr double kLensSigma = 0.001;
  add(kDistortion, kLensSigma);
  add(kDistortion + 1, kLensSigma);
  add(kLogFocal, std::max(input.least_gyro_scale_sigma, noise.gyro_scale_sigma));
  result.sigma = result.covariance.diagonal().cwiseSqrt();
}

// Standard deviation of what the intervals between images make of the time offset.
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
  // A global shutter's may come out a little below.
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

// What best explains a part of the pairs, among the rotations searched.
struct Choice {
  Hypothesis best;
  double next_cost = 0;  // of the best other rotation, over the best one's; 0: there is none
};

Choice ChooseRotation(const Input& input, std::span<const FramePair> pairs, int64_t origin) {
  const std::vector<Eigen::Quaterniond> rotations =
      input.q_body_cam ? std::vector{*input.q_body_cam} : AxisAlignedRotations();
  const std::vector<double> fields =
      input.field_of_view ? std::vector{*input.field_of_view}
                          : std::vector<double>(std::begin(kFieldsOfView), std::end(kFieldsOfView));
  const std::vector<FramePair> searched = WithMostMotion(Pairs(input, kSearchGap_s, origin));
  std::vector<Hypothesis> found =
      Search(searched, input.imu, origin, NominalCamera(input, CameraModel::Kind::kRadtan),
             rotations, fields);
  // The gyroscope's bias may hide the right one: each is refined a little before most are dropped.
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

// How surely `worse` is worse than `better`, in standard deviations: by the signed ranks of the
// differences of blocks of time, which are independent witnesses (Wilcoxon, Biometrics 1945). Their
// sizes differ as the motion does, so that their mean tells little.
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

// Of all rotations what fits instead of the given one, if the points speak against that: the best
// is not where the given one may be, and where the given one led is not there either or fits worse.
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

// With either kind of lens; the one that explains more.
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

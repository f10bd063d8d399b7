#include "calibration/calibrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/median.h"
#include "core/rigid3.h"

namespace pangea::calibration {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kFieldsOfView[] = {52 * kDegree, 65 * kDegree, 80 * kDegree};
constexpr double kOtherRotation = 0.5;  // rad
constexpr CameraModel::Kind kLenses[] = {CameraModel::Kind::kRadtan,
                                         CameraModel::Kind::kEquidistant};

CameraModel Nominal(const Input& input, const Options& options, CameraModel::Kind lens) {
  CameraModel camera;
  camera.kind = lens;
  camera.width = input.width;
  camera.height = input.height;
  camera.cx = 0.5 * (input.width - 1);
  camera.cy = 0.5 * (input.height - 1);
  camera.readout_s = options.readout_s;
  return camera;
}

Prior PriorOf(const Input& input, const Options& options, const Parameters& mean) {
  Prior prior;
  prior.mean = mean;
  prior.sigma.segment<3>(kRotation).setConstant(input.q_body_cam ? options.sigma_given_rotation
                                                                 : options.sigma_axis_aligned);
  prior.sigma.segment<3>(kGyroBias).setConstant(options.sigma_gyro_bias);
  prior.sigma[kTimeOffset] = options.sigma_time_offset_s;
  prior.sigma[kLogFocal] =
      input.field_of_view ? options.sigma_given_log_focal : options.sigma_log_focal;
  prior.sigma.segment<2>(kCentre).setConstant(options.sigma_centre *
                                              std::max(input.width, input.height));
  prior.sigma.segment<2>(kDistortion)
      .setConstant(mean.camera.kind == CameraModel::Kind::kEquidistant
                       ? options.sigma_distortion_equidistant
                       : options.sigma_distortion);
  prior.sigma[kReadout] = options.sigma_readout_s;
  return prior;
}

// First without the lens: focal length and distortion run away together while the rotation is
// rough.
Solution Refined(const Solver& solver, const Hypothesis& hypothesis, Prior prior) {
  Prior first = prior;
  first.sigma.tail<kSize - kLogFocal>().setZero();
  return solver.Solve(solver.Solve(hypothesis.parameters, first).parameters, prior);
}

// With inertial samples all around, wherever the clocks are.
std::vector<FramePair> Pairs(const Input& input, const Options& options, const FramePairOptions& of,
                             int64_t origin) {
  std::vector<FramePair> pairs = MakePairs(input.frames, origin, of);
  const OrientationCurve curve(input.imu, origin, Eigen::Vector3d::Zero());
  const double margin_s = options.search.max_offset_s + 2 * options.sigma_time_offset_s;
  std::erase_if(pairs, [&](const FramePair& pair) {
    return !curve.Covers(pair.a_s - margin_s, pair.b_s + margin_s);
  });
  return pairs;
}

// Half of what lies between the results of the recording's halves: what the residuals do not show,
// such as a focus or a delay that changes.
Tangent HalfDifference(const Input& input, const Options& options, std::span<const FramePair> pairs,
                       int64_t origin, const Solution& solution, const Prior& prior) {
  const size_t middle = pairs.size() / 2;
  const auto part = [&](std::span<const FramePair> half) {
    return Solver(half, input.imu, origin, options.solver).Solve(solution.parameters, prior);
  };
  const Parameters first = part(pairs.first(middle)).parameters;
  const Parameters second = part(pairs.subspan(middle)).parameters;
  return 0.5 * first.Minus(second);
}

// Rotation of the camera, rad/s, rms about each of its axes, while points were seen.
Eigen::Vector3d RotationRms(std::span<const FramePair> pairs, std::span<const ImuSample> imu,
                            int64_t origin_utime, const Parameters& parameters) {
  const OrientationCurve curve(imu, origin_utime, parameters.gyro_bias);
  Eigen::Vector3d squared = Eigen::Vector3d::Zero();
  for (const FramePair& pair : pairs) {
    const double a_s = pair.a_s + parameters.MiddleRowOffset_s();
    const double b_s = pair.b_s + parameters.MiddleRowOffset_s();
    const Eigen::Vector3d rotation =
        LogSo3(curve.At(a_s).conjugate() * curve.At(b_s)) / (b_s - a_s);
    squared += (parameters.camera.T_body_cam.q.conjugate() * rotation).cwiseAbs2();
  }
  return (squared / static_cast<double>(std::max<size_t>(1, pairs.size()))).cwiseSqrt();
}

// A gyroscope that reads too little makes lenses too long, by the same share.
void AddFloors(const ImuNoise& noise, double gyro_scale_sigma, Result& result) {
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
  add(kLogFocal, std::max(gyro_scale_sigma, noise.gyro_scale_sigma));
  result.sigma = result.covariance.diagonal().cwiseSqrt();
}

std::string Refusal(const Result& result, const Options& options) {
  const Tangent& sigma = result.sigma;
  const double offset_s = std::abs(result.parameters.MiddleRowOffset_s());
  const double field = FieldOfView(result.parameters.camera);
  if (offset_s > options.search.max_offset_s || field < options.min_field_of_view ||
      field > options.max_field_of_view) {
    return fmt::format(
        "what fits best is no phone's: a field of view of {:.0f} degrees, a time offset of {:.0f} "
        "ms: rotate more, about all three axes",
        field / kDegree, 1e3 * offset_s);
  }
  if (result.sigma_px > options.max_sigma_px) {
    return fmt::format(
        "points are {:.1f} px off what the gyroscope says (at most {} are plausible): stamps, "
        "units "
        "or axes of the IMU are wrong, or much in the image moves by itself",
        result.sigma_px, options.max_sigma_px);
  }
  if (result.next_cost > 0 && result.next_cost < options.min_cost_ratio) {
    return fmt::format(
        "another rotation of the camera fits as well ({:.1f} % worse): rotate more, "
        "about all three axes",
        100 * (result.next_cost - 1));
  }
  const double rotation = sigma.segment<3>(kRotation).maxCoeff();
  if (rotation > options.max_sigma_rotation) {
    return fmt::format(
        "the rotation camera to IMU is known to {:.1f} degrees only: rotate more, "
        "about at least two axes",
        rotation / kDegree);
  }
  if (sigma[kLogFocal] > options.max_sigma_log_focal) {
    return fmt::format("the focal length is known to {:.0f} % only: rotate more, to and fro",
                       100 * sigma[kLogFocal]);
  }
  if (sigma[kTimeOffset] > options.max_sigma_time_offset_s) {
    return fmt::format(
        "the time offset is known to {:.0f} ms only: begin and end rotations briskly",
        1e3 * sigma[kTimeOffset]);
  }
  return "";
}

double SecondsOf(std::span<const FramePair> pairs, double step_s) {
  return step_s * static_cast<double>(pairs.size());
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

}  // namespace

// What best explains a part of the pairs, among the rotations searched.
struct Choice {
  Hypothesis best;
  double next_cost = 0;  // of the best other rotation, over the best one's; 0: there is none
};

Choice ChooseRotation(const Input& input, const Options& options, std::span<const FramePair> pairs,
                      int64_t origin) {
  const std::vector<Eigen::Quaterniond> rotations =
      input.q_body_cam ? std::vector{*input.q_body_cam} : AxisAlignedRotations();
  const std::vector<double> fields =
      input.field_of_view ? std::vector{*input.field_of_view}
                          : std::vector<double>(std::begin(kFieldsOfView), std::end(kFieldsOfView));
  FramePairOptions shorter = options.pairs;
  shorter.max_gap_s = options.search_gap_s;
  const std::vector<FramePair> searched =
      WithMostMotion(Pairs(input, options, shorter, origin), options.search);
  std::vector<Hypothesis> found =
      Search(searched, input.imu, origin, Nominal(input, options, CameraModel::Kind::kRadtan),
             rotations, fields, options.search);
  SolverOptions stiff = options.solver;
  stiff.velocity_change = options.search.velocity_change;
  // The gyroscope's bias may hide the right one: each is refined a little before most are dropped.
  const Solver roughly(searched, input.imu, origin, stiff);
  for (Hypothesis& hypothesis : found) {
    Prior first = PriorOf(input, options, hypothesis.parameters);
    first.sigma.tail<kSize - kLogFocal>().setZero();
    const Solution solution = roughly.Solve(hypothesis.parameters, first);
    hypothesis = {solution.parameters, solution.cost};
  }
  std::ranges::stable_sort(found, {}, &Hypothesis::cost);
  found.resize(std::min(found.size(), static_cast<size_t>(options.max_refined)));
  std::vector<FramePair> some;
  for (size_t i = 0; i < pairs.size(); i += static_cast<size_t>(options.choose_on_every)) {
    some.push_back(pairs[i]);
  }
  const Solver solver(some, input.imu, origin, stiff);
  for (Hypothesis& hypothesis : found) {
    const Solution solution =
        Refined(solver, hypothesis, PriorOf(input, options, hypothesis.parameters));
    hypothesis = {solution.parameters, solution.cost};
  }
  std::ranges::stable_sort(found, {}, &Hypothesis::cost);
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

// With either kind of lens; the one that explains more.
Solution SolveAll(const Input& input, const Options& options, std::span<const FramePair> pairs,
                  int64_t origin, const Parameters& start) {
  const Solver solver(pairs, input.imu, origin, options.solver);
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
    const Solution solution = Refined(solver, {mean, 0}, PriorOf(input, options, mean));
    if (solution.cost < best.cost) {
      best = solution;
    }
  }
  const Tangent apart =
      HalfDifference(input, options, pairs, origin, best, PriorOf(input, options, best.parameters));
  for (int row = 0; row < kSize; ++row) {
    const double scale = std::max(1.0, std::abs(apart[row]) / std::sqrt(best.covariance(row, row)));
    best.covariance.row(row) *= scale;
    best.covariance.col(row) *= scale;
  }
  return best;
}

Result Calibrate(const Input& input, const Options& options) {
  Result result;
  if (input.frames.empty() || input.imu.size() < 2) {
    result.refused = "there are no images or no inertial samples";
    return result;
  }
  const int64_t origin = input.frames.front().utime;
  result.image_rate_hz =
      static_cast<double>(input.frames.size()) /
      std::max(1e-3, 1e-6 * static_cast<double>(input.frames.back().utime - origin));
  const std::vector<FramePair> pairs = Pairs(input, options, options.pairs, origin);
  result.seconds = SecondsOf(pairs, options.pairs.step_s);
  if (result.seconds < options.min_seconds) {
    result.refused = fmt::format(
        "points could be followed for {:.0f} s, at least {:.0f} are needed: record longer, with "
        "more "
        "light or more to see",
        result.seconds, options.min_seconds);
    return result;
  }
  std::vector<size_t> counts;
  for (const FramePair& pair : pairs) {
    counts.push_back(pair.points.size());
  }
  result.points = static_cast<double>(Median(counts));
  const Choice choice = ChooseRotation(input, options, pairs, origin);
  result.next_cost = choice.next_cost;
  Fill(SolveAll(input, options, pairs, origin, choice.best.parameters), result);
  result.rotation_rms = RotationRms(pairs, input.imu, origin, result.parameters);
  AddFloors(input.imu_noise, options.sigma_gyro_scale, result);
  result.refused = Refusal(result, options);
  return result;
}

}  // namespace pangea::calibration

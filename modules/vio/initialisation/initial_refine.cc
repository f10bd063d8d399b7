// Bundle adjustment of the start-up window.

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "core/imu/preintegration.h"
#include "vio/initialisation/initial_solution.h"
#include "vio/initialisation/start_problem.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kInlierSigmas = 4.0;
constexpr double kOutlierCost = 6;  // Huber cost of an outlier ray (start_problem.cc)
constexpr std::array<double, 2> kOtherScales = {0.4, 2.5};
constexpr double kMaxDistance = 200;  // m, of a point: beyond it the start's baseline says nothing
// A point in the direction of motion has no depth, and one such point makes the system singular. So
// each point has a prior at its closed-form position, with a sigma of this many times its distance.
constexpr double kPointPrior = 10;
constexpr double kMinRefinedDepth = 0.1;  // m, of a point before a camera that saw it
// The closed-form scale is too small if noise is large compared with the accelerations, and the
// cost is flat along scale: fewer iterations would stop half way, where the covariance is smaller.
constexpr int kMaxIterations = 100;

void AddStates(const Quaterniond& q_odom_first, const LinearStart& start, StartProblem* problem) {
  for (size_t k = 0; k < start.T_first_body.size(); ++k) {
    ImuState state;
    state.T_odom_body = Rigid3(q_odom_first, Vector3d::Zero()) * start.T_first_body[k];
    state.v_odom_body = q_odom_first * start.v_first_body[k];
    state.gyro_bias = problem->expected_gyro_bias;
    problem->states.push_back(state);
  }
}

void AddImuFactors(std::span<const StartFrame> frames, const ImuNoise& noise,
                   StartProblem* problem) {
  for (size_t k = 1; k < frames.size(); ++k) {
    Preintegrator integrator(noise, problem->expected_gyro_bias, Vector3d::Zero());
    integrator.Add(frames[k].imu);
    StartImuFactor factor{integrator.result(), {}};
    // Keeps a span of a single sample invertible: positions to 1 micrometre.
    factor.measured.covariance.diagonal().array() += 1e-12;
    factor.information =
        factor.measured.covariance.llt().solve(Eigen::Matrix<double, 9, 9>::Identity());
    problem->imu_factors.push_back(factor);
  }
}

void AddStamps(std::span<const StartFrame> frames, StartProblem* problem) {
  for (size_t k = 0; k < frames.size(); ++k) {
    const ImuSample& at_stamp = k == 0 ? frames[1].imu.front() : frames[k].imu.back();
    problem->stamps.push_back({at_stamp.gyro - problem->expected_gyro_bias, 0});
  }
}

// Uses only rays whose point is in front of the camera. Returns the number of all rays, used or
// not.
int AddPoints(std::span<const StartFrame> frames, const Quaterniond& q_odom_first,
              const LinearStart& start, StartProblem* problem) {
  std::map<int32_t, StartPoint> points;
  int rays = 0;
  for (size_t k = 0; k < frames.size(); ++k) {
    const Rigid3 T_cam_odom = (problem->states[k].T_odom_body * problem->T_body_cam).Inverse();
    for (const auto& [id, ray] : frames[k].rays) {
      const auto found = start.p_first.find(id);
      if (found == start.p_first.end() || found->second.norm() > kMaxDistance) {
        continue;
      }
      ++rays;
      const Vector3d p_odom = q_odom_first * found->second;
      if (!((T_cam_odom * p_odom).z() > kMinRefinedDepth)) {
        continue;
      }
      StartPoint& point = points[id];
      if (point.rays.empty()) {
        point.p_odom = point.expected = p_odom;
        point.expected_sigma = kPointPrior * (1 + p_odom.norm());
      }
      point.rays.push_back({static_cast<int>(k), ray});
    }
  }
  for (const auto& [id, point] : points) {
    // One ray gives no depth: a point that stays where it is would stop a camera that moves ahead.
    if (point.rays.size() > 1) {
      problem->points.push_back(point);
    }
  }
  return rays;
}

void SumUpRays(const StartProblem& problem, int rays, RefinedStart* out) {
  double sum = 0;
  int inliers = 0;
  for (const double error : problem.RayErrors()) {
    if (error < kInlierSigmas) {
      ++inliers;
      sum += error * error;
    }
  }
  out->inlier_share = rays > 0 ? static_cast<double>(inliers) / rays : 0;
  out->rms_sigma = inliers > 0 ? std::sqrt(sum / (2.0 * inliers)) : 1e9;
}

}  // namespace

std::optional<RefinedStart> Refine(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                   const ImuNoise& noise, const Vector3d& gyro_bias,
                                   const LinearStart& start, const StartSigmas& sigmas) {
  StartProblem problem;
  problem.T_body_cam = T_body_cam;
  problem.ray_sigma = sigmas.ray;
  problem.expected_gyro_bias = gyro_bias;
  problem.accel_bias_sigma = sigmas.accel_bias;
  problem.time_offset_sigma_s = sigmas.time_offset_s;
  problem.stamp_sigma_s = sigmas.stamp_s;
  const Quaterniond q_odom_first = Quaterniond::FromTwoVectors(-start.gravity, Vector3d::UnitZ());
  AddStates(q_odom_first, start, &problem);
  AddImuFactors(frames, noise, &problem);
  AddStamps(frames, &problem);
  const int rays = AddPoints(frames, q_odom_first, start, &problem);
  RefinedStart out;
  int counted = 0;
  for (const StartPoint& point : problem.points) {
    counted += static_cast<int>(point.rays.size());
  }
  out.inlier_share = rays > 0 ? static_cast<double>(counted) / rays : 0;
  if (out.inlier_share < kMinInlierShare) {
    return out;  // points behind the cameras would stay there: refining is useless
  }
  if (!problem.Optimise(kMaxIterations)) {
    return std::nullopt;
  }
  const auto covariance = problem.NewestCovariance();
  if (!covariance) {
    return std::nullopt;
  }
  SumUpRays(problem, rays, &out);
  out.states = problem.states;
  out.time_offset_error_s = problem.time_offset_error_s;
  for (const StartStamp& stamp : problem.stamps) {
    out.stamp_errors_s.push_back(stamp.error_s);
  }
  out.cost = problem.Cost() + kOutlierCost * (rays - counted);
  for (ImuState& state : out.states) {
    state.T_odom_body.t -= problem.states.back().T_odom_body.t;
  }
  out.tilt_sigma = std::sqrt(std::max((*covariance)(0, 0), (*covariance)(1, 1)));
  out.velocity_sigma = std::sqrt(
      Eigen::SelfAdjointEigenSolver<Matrix3d>(Matrix3d(covariance->bottomRightCorner<3, 3>()))
          .eigenvalues()[2]);
  return out;
}

std::optional<RefinedStart> RefineInFront(const RefineFrom& refine, LinearStart* start) {
  std::optional<RefinedStart> refined = refine(*start);
  if (refined && refined->inlier_share < 1 - kMinInlierShare) {
    *start = Scaled(std::move(*start), -1);
    refined = refine(*start);
  }
  return refined;
}

std::optional<MovingStart> BetterOf(std::optional<MovingStart> a, std::optional<MovingStart> b) {
  const auto cost = [](const std::optional<MovingStart>& start) {
    return start && start->refined ? start->refined->cost : std::numeric_limits<double>::infinity();
  };
  return cost(b) < cost(a) || !a ? std::move(b) : std::move(a);
}

RefinedStart BestOfScales(const RefineFrom& refine, const LinearStart& start, RefinedStart first) {
  RefinedStart best = std::move(first);
  for (const double scale : kOtherScales) {
    if (auto other = refine(Scaled(start, scale)); other && other->cost < best.cost) {
      best = std::move(*other);
    }
  }
  return best;
}

}  // namespace pangea::vio

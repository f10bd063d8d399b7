#include "vio/window/window_problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/least_squares/levenberg_marquardt.h"
#include "vio/window/landmarks/landmark_factor.h"
#include "vio/window/window_factors.h"
#include "vio/window/window_solver.h"

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kMinInverseDepth = 1e-4;  // 1/m
// The last iteration is the one with a predicted decrease of the cost below this (a decrease of 0.5
// is one sigma along one direction).
constexpr double kEnough = 0.02;
constexpr int kMaxRetries = 6;

void Step(const NormalEquations& equations, const VectorXd& step, WindowProblem* problem) {
  WindowState& state = problem->state;
  for (size_t l = 0; l < problem->landmarks.size(); ++l) {
    Landmark& landmark = problem->landmarks[l];
    const NormalEquations::Elimination& elimination = equations.eliminations[l];
    Vector3d d = elimination.offset +
                 elimination.gain.leftCols<kCalibrationSize>() * step.head<kCalibrationSize>();
    for (size_t j = 0; j < landmark.rays.size(); ++j) {
      const int at = elimination.RayColumn(j), frame = landmark.rays[j].frame;
      const int offset = state.FirstRow(frame);
      d += elimination.gain.middleCols<kPoseSize>(at) * step.segment<kPoseSize>(offset);
      if (state.frames[frame].has_stamp_error()) {
        d += elimination.gain.col(at + kPoseSize) * step[offset + kStampError];
      }
    }
    landmark.point.ray_rho += d;
    landmark.point.ray_rho.z() = std::max(landmark.point.ray_rho.z(), kMinInverseDepth);
  }
  state.Retract(step);
}

// Landmarks fill only the upper triangle.
void MirrorUpper(MatrixXd* H) { H->triangularView<Eigen::StrictlyLower>() = H->transpose(); }

// Linearises all factors of the oldest full frame, with the landmarks anchored in it.
NormalEquations LineariseOldest(const WindowProblem& problem, int oldest) {
  const WindowState& state = problem.state;
  NormalEquations out;
  out.H.setZero(state.size(), state.size());
  out.g.setZero(state.size());
  AddPrior(problem, &out);
  if (problem.imu_factors[oldest + 1]) {
    AddImuFactor(state, *problem.imu_factors[oldest + 1], oldest + 1, &out);
  }
  if (StationaryTogether(problem, oldest + 1)) {
    AddZeroMotionUpdate(state, oldest + 1, &out);
  }
  if (state.frames[oldest].stationary) {
    AddZeroVelocityUpdate(state, oldest, &out);
  }
  if (state.frames[oldest].has_stamp_error()) {
    AddStampError(state, oldest, &out);
  }
  RowViews rows(state);
  for (const Landmark& landmark : problem.landmarks) {
    if (landmark.point.anchor == oldest) {
      AddLandmark(rows, landmark, 0, &out);
    }
  }
  MirrorUpper(&out.H);
  return out;
}

void EraseFrame(WindowProblem& problem, int index) {
  problem.state.frames.erase(problem.state.frames.begin() + index);
  problem.imu_factors.erase(problem.imu_factors.begin() + index);
  for (Landmark& landmark : problem.landmarks) {
    landmark.point.anchor -= landmark.point.anchor > index ? 1 : 0;
    std::erase_if(landmark.rays, [index](const FrameRay& ray) { return ray.frame == index; });
    for (FrameRay& ray : landmark.rays) {
      ray.frame -= ray.frame > index ? 1 : 0;
    }
  }
}

}  // namespace

WindowEstimate WindowProblem::Estimate() const {
  WindowEstimate estimate{state, {}};
  estimate.ray_rhos.reserve(landmarks.size());
  for (const Landmark& landmark : landmarks) {
    estimate.ray_rhos.push_back(landmark.point.ray_rho);
  }
  return estimate;
}

void WindowProblem::SetEstimate(WindowEstimate estimate) {
  state = std::move(estimate.state);
  for (size_t l = 0; l < landmarks.size(); ++l) {
    landmarks[l].point.ray_rho = estimate.ray_rhos[l];
  }
}

NormalEquations Linearise(const WindowProblem& problem, double damping) {
  const int n = problem.state.size();
  NormalEquations out;
  out.H.setZero(n, n);
  out.g.setZero(n);
  AddPrior(problem, &out);
  for (int i = 0; i <= problem.state.Newest(); ++i) {
    if (problem.imu_factors[i]) {
      AddImuFactor(problem.state, *problem.imu_factors[i], i, &out);
    }
    if (StationaryTogether(problem, i)) {
      AddZeroMotionUpdate(problem.state, i, &out);
    }
    if (problem.state.frames[i].stationary) {
      AddZeroVelocityUpdate(problem.state, i, &out);
    }
    if (problem.state.frames[i].has_stamp_error()) {
      AddStampError(problem.state, i, &out);
    }
  }
  RowViews rows(problem.state);
  for (const Landmark& landmark : problem.landmarks) {
    AddLandmark(rows, landmark, damping, &out);
  }
  MirrorUpper(&out.H);
  return out;
}

double Optimise(WindowProblem& problem, int max_iterations) {
  const LevenbergMarquardtOptions options = {.max_iterations = max_iterations,
                                             .max_retries = kMaxRetries,
                                             .min_decrease = kEnough,
                                             .tolerance = 1e-6};
  const auto solve = [](const WindowProblem& at, const NormalEquations& equations) -> VectorXd {
    return SolveWindow(at.state, equations.H, equations.g);
  };
  return LevenbergMarquardt(options, Linearise, solve, Step, Cost, &problem).cost;
}

MatrixXd WindowCovariance(const WindowProblem& problem, const std::vector<int>& rows) {
  const MatrixXd H = Linearise(problem, 0).H;
  MatrixXd units = MatrixXd::Zero(H.rows(), static_cast<Eigen::Index>(rows.size()));
  for (size_t k = 0; k < rows.size(); ++k) {
    units(rows[k], static_cast<Eigen::Index>(k)) = 1;
  }
  const MatrixXd columns = SolveWindow(problem.state, H, units)(rows, Eigen::all);
  MatrixXd P = MatrixXd::Zero(H.rows(), H.cols());
  P(rows, rows) = 0.5 * (columns + columns.transpose());
  return P;
}

void MarginaliseOldest(WindowProblem& problem, const Marginalisation& what) {
  WindowState& state = problem.state;
  const int oldest = state.frames.front().pose_only ? 1 : 0;
  const NormalEquations equations = LineariseOldest(problem, oldest);
  std::erase_if(problem.landmarks,
                [oldest](const Landmark& landmark) { return landmark.point.anchor == oldest; });

  // Which rows stay.
  std::vector<int> stay, go;
  const int at_oldest = state.FirstRow(oldest);
  const bool drops_kept = oldest == 1 && what.drop_kept_pose;
  for (int i = 0; i < state.size(); ++i) {
    const bool of_kept = oldest == 1 && i >= kSharedSize && i < at_oldest;
    const bool of_oldest = i >= at_oldest && i < at_oldest + state.frames[oldest].size();
    const bool goes =
        of_kept ? drops_kept : of_oldest && !(what.keep_pose && i < at_oldest + kPoseSize);
    (goes ? go : stay).push_back(i);
  }
  const MatrixXd H_gs = equations.H(go, stay);
  const MatrixXd gain = SolveScaled(equations.H(go, go), H_gs);
  const VectorXd g_go = equations.g(go);
  WindowPrior& prior = problem.prior;
  prior.H = equations.H(stay, stay) - H_gs.transpose() * gain;
  prior.H = 0.5 * (prior.H + prior.H.transpose()).eval();
  prior.g = equations.g(stay) - gain.transpose() * g_go;

  problem.imu_factors[oldest + 1].reset();
  if (what.keep_pose) {
    WindowFrame& kept = state.frames[oldest];
    kept.pose_only = true;
    kept.stationary = false;
    problem.imu_factors[oldest].reset();
  } else {
    EraseFrame(problem, oldest);
  }
  if (drops_kept) {
    EraseFrame(problem, 0);
  }
  prior.at = state;
}

}  // namespace pangea::vio

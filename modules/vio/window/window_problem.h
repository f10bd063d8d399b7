#pragma once

// The sliding window as a least-squares problem: rays of landmarks, inertial measurements between
// consecutive frames, zero-velocity updates, and a prior that holds what has left the window.
//
// Landmarks are eliminated one by one (Schur complement); the reduced system is small and dense.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/imu/imu_factor.h"
#include "vio/window/point_geometry.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

struct Landmark {
  int32_t id = 0;
  AnchoredPoint point;
  std::vector<FrameRay> rays;  // at most one a frame; the anchor's own is among them
};

struct ImuFactor {
  ScaledPreintegration span;
  ImuNoise noise;             // that `information` counts, unless contradicted
  bool contradicted = false;  // by the images (unmodelled_acceleration.h)
  Eigen::Matrix<double, 15, 15> information = Eigen::Matrix<double, 15, 15>::Zero();
};

// 1/2 e^T H e + g^T e with e = Difference(state, at), over the calibration, the IMU's scale factors
// and the first at.frames.size() frames of the window.
struct WindowPrior {
  WindowState at;
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

// What optimising moves.
struct WindowEstimate {
  WindowState state;
  std::vector<Eigen::Vector3d> ray_rhos;  // of each landmark
};

struct WindowProblem {
  WindowState state;
  std::vector<std::optional<ImuFactor>> imu_factors;  // imu_factors[i]: from frame i - 1 to frame i
  std::vector<Landmark> landmarks;
  WindowPrior prior;

  WindowEstimate Estimate() const;
  void SetEstimate(WindowEstimate estimate);
};

// The cost and its derivatives by the window's error, landmarks eliminated:
// cost(state (+) e) ~ cost + g^T e + 1/2 e^T H e.
struct NormalEquations {
  double cost = 0;
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  // What a step of the window means for each landmark: step = offset + gain * (step of its frames).
  struct Elimination {
    Eigen::Vector3d offset;
    // Columns: calibration, then of each ray's frame the pose and, if `stamps`, the stamp's error.
    Eigen::Matrix<double, 3, Eigen::Dynamic> gain;
    bool stamps = false;

    int RayColumn(size_t ray) const {
      return kCalibrationSize + (stamps ? kPoseSize + 1 : kPoseSize) * static_cast<int>(ray);
    }
  };
  std::vector<Elimination> eliminations;
};
// `damping`: Levenberg-Marquardt's, a share of the diagonal.
NormalEquations Linearise(const WindowProblem& problem, double damping);

// Optimises state and landmarks in place; the final cost.
double Optimise(WindowProblem& problem, int max_iterations);

// Marginal covariance of the window's error: these rows and columns of it, zero elsewhere.
Eigen::MatrixXd WindowCovariance(const WindowProblem& problem, const std::vector<int>& rows);

// Takes the oldest full frame out of the window (all of it, or all but its pose), with the
// landmarks anchored in it, the IMU factor to the next frame and what the prior says of it; what
// they tell of the rest goes into the prior. A pose kept before goes too when `drop_kept_pose`.
struct Marginalisation {
  bool keep_pose = false;
  bool drop_kept_pose = false;
};
void MarginaliseOldest(WindowProblem& problem, const Marginalisation& what);

}  // namespace pangea::vio

#pragma once

// The sliding window as a least-squares problem: rays of landmarks, inertial measurements between
// consecutive frames, zero-velocity updates, and a prior with the information of marginalised
// frames.
//
// Landmarks are eliminated one by one (Schur complement); the reduced system is small and dense.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/imu/imu_factor.h"
#include "vio/window/landmarks/point_geometry.h"
#include "vio/window/window_state.h"

namespace pangea::vio {

struct Landmark {
  int32_t id = 0;
  AnchoredPoint point;
  std::vector<FrameRay> rays;  // at most one per frame; includes the anchor's own
};

struct ImuFactor {
  ScaledPreintegration span;
  ImuNoise noise;             // from which `information` is made, unless contradicted
  bool contradicted = false;  // the images contradict it (unmodelled_acceleration.h)
  Eigen::Matrix<double, 15, 15> information = Eigen::Matrix<double, 15, 15>::Zero();
};

// 1/2 e^T H e + g^T e with e = Difference(state, at), over the calibration, the IMU's scale factors
// and the first at.frames.size() frames of the window.
struct WindowPrior {
  WindowState at;
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

// The variables that Optimise changes.
struct WindowEstimate {
  WindowState state;
  std::vector<Eigen::Vector3d> ray_rhos;  // AnchoredPoint::ray_rho of each landmark
};

struct WindowProblem {
  WindowState state;
  std::vector<std::optional<ImuFactor>> imu_factors;  // imu_factors[i]: from frame i - 1 to frame i
  std::vector<Landmark> landmarks;
  WindowPrior prior;

  WindowEstimate Estimate() const;
  void SetEstimate(WindowEstimate estimate);
};

// The cost and its derivatives with respect to the window's error e, landmarks eliminated:
// cost(state (+) e) ~ cost + g^T e + 1/2 e^T H e.
struct NormalEquations {
  double cost = 0;
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  // The step of each landmark: offset + gain * (step of the calibration and of its frames).
  struct Elimination {
    Eigen::Vector3d offset;
    // Columns: calibration, then per ray the pose of its frame and, if `stamps`, its stamp error.
    Eigen::Matrix<double, 3, Eigen::Dynamic> gain;
    bool stamps = false;

    int RayColumn(size_t ray) const {
      return kCalibrationSize + (stamps ? kPoseSize + 1 : kPoseSize) * static_cast<int>(ray);
    }
  };
  std::vector<Elimination> eliminations;
};
// `damping`: of Levenberg-Marquardt, relative to the diagonal.
NormalEquations Linearise(const WindowProblem& problem, double damping);

// Optimises state and landmarks in place; returns the final cost.
double Optimise(WindowProblem& problem, int max_iterations);

// Marginal covariance of the window's error: full size, but only `rows` are computed (rows and
// columns); the rest is zero.
Eigen::MatrixXd WindowCovariance(const WindowProblem& problem, const std::vector<int>& rows);

// Marginalises the oldest full frame (entirely, or all but its pose if `keep_pose`), the landmarks
// anchored in it and the IMU factor to the next frame: their information on the remaining variables
// goes into the prior. `drop_kept_pose`: also marginalises a pose that was kept before.
struct Marginalisation {
  bool keep_pose = false;
  bool drop_kept_pose = false;
};
void MarginaliseOldest(WindowProblem& problem, const Marginalisation& what);

}  // namespace pangea::vio

#pragma once

// A small window for tests: frames that follow their inertial samples exactly, and points that all
// frames see.

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "vio/window/window_problem.h"

namespace pangea::vio {

struct WindowTestOptions {
  uint64_t seed = 1;
  int frames = 5;
  int landmarks = 12;        // landmark i: anchored in frame i % (frames - 1), seen from there on
  double ray_noise = 0;      // sigmas
  double row_s = 0;          // rows are exposed up to this long after the image's time
  double stamp_sigma_s = 0;  // of the stamps; every second frame's error is a variable
  double interval_sigma_s = 0.01;  // of the intervals between images
  double late_s = 0;               // change of the time offset since the frames were added
};

// State and landmarks are the truth; the prior has no information.
WindowProblem TestWindow(const WindowTestOptions& options);

// Inertial samples of a lively motion, roughly upright.
std::vector<ImuSample> TestSamples(int count, int64_t first_utime, uint64_t seed);
Preintegration Integrate(std::span<const ImuSample> samples, const ImuNoise& noise,
                         const Eigen::Vector3d& gyro_bias, const Eigen::Vector3d& accel_bias);

// Sets a prior with this sigma on the calibration and on the whole state of the first frame.
void HoldStart(WindowProblem* problem, double sigma);

// A random error of all the window's variables.
Eigen::VectorXd RandomError(const WindowState& state, double sigma, uint64_t seed);

// The four directions that camera and IMU cannot observe, as columns: a shift along odom's axes,
// and a rotation about its z axis.
Eigen::MatrixXd UnobservableDirections(const WindowState& state);

// Central differences along the window's error coordinates.
Eigen::MatrixXd NumericJacobian(const WindowState& state,
                                const std::function<Eigen::VectorXd(const WindowState&)>& f);

}  // namespace pangea::vio

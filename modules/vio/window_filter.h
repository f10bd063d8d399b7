#pragma once

// A Kalman filter over a sliding window of camera poses, with a few long-lived landmarks in its
// state.
//
// Source: Mourikis & Roumeliotis, ICRA 2007 (MSCKF); Li & Mourikis, IJRR 2013 (landmarks in the
// state, time offset); right-invariant errors as in window_state.h.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "common/imu.h"
#include "vio/window_state.h"

namespace pangea::vio {

// Rows of a linearised measurement: r = H * error + n.
struct Measurement {
  Eigen::MatrixXd H;
  Eigen::VectorXd r;
};

class WindowFilter {
 public:
  WindowFilter(const ImuNoise& noise, WindowState initial);

  const WindowState& state() const { return state_; }
  WindowState& mutable_state() { return state_; }

  // Moves the IMU state along consecutive samples, the first at the state's time, the last at the
  // new time.
  void Propagate(std::span<const ImuSample> samples);
  // Adds the IMU's pose as the newest camera pose. `omega_body` is the turn rate there, for the
  // time offset.
  void AddClone(int64_t utime, const Eigen::Vector3d& omega_body);
  void RemoveClone(int index);
  void RemoveLandmark(int index);

  // Adds a landmark from its stacked measurement r = Hx x + Hf f + n with isotropic `sigma` (in r's
  // unit): its three best-conditioned directions make its covariance, the rest updates the state
  // (Li & Mourikis' delayed start).
  void AddLandmark(int32_t landmark_id, const AnchoredPoint& point, const Measurement& x,
                   const Eigen::MatrixXd& H_f, double sigma);
  // Moves a landmark to another anchor: new = g(old, x), with the Jacobian of the new coordinates.
  void ReplaceLandmark(int index, const AnchoredPoint& point, const Eigen::MatrixXd& J);

  // Normalised innovation squared of a measurement with noise sigma^2 I.
  double Nis(const Measurement& m, double sigma) const;
  // Kalman update with noise sigma^2 I.
  void Update(const Measurement& m, double sigma);

 private:
  ImuNoise noise_;
  WindowState state_;
};

}  // namespace pangea::vio

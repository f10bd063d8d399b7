#include "vio/window_start.h"

#include <Eigen/Cholesky>

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

// Prior uncertainty of the given calibration.
constexpr double kExtrinsicsRotationSigma = 0.005;  // rad
constexpr double kExtrinsicsPositionSigma = 0.005;  // m
constexpr double kTimeOffsetSigma = 0.005;          // s
constexpr double kFocalSigma = 0.001;               // of the focal length
constexpr double kCentreSigma = 0.001;              // of the focal length: half a pixel

// Of a moving start: next to nothing on tilt and velocity, and what a consumer's IMU may have.
constexpr double kTiltSigma = 0.5;        // rad
constexpr double kVelocitySigma = 5;      // m/s
constexpr double kGyroBiasSigma = 0.05;   // rad/s, about what was found
constexpr double kAccelBiasSigma = 0.15;  // m/s^2, about zero

// From (dtheta, dp, dv) to right-invariant errors: xi = d - dtheta x value.
Matrix15d ToInvariant(const ImuState& imu, const Matrix15d& covariance) {
  Matrix15d J = Matrix15d::Identity();
  J.block<3, 3>(kPosition, kTheta) = Hat(imu.T_odom_body.t);
  J.block<3, 3>(kVelocity, kTheta) = Hat(imu.v_odom_body);
  return J * covariance * J.transpose();
}

}  // namespace

WindowPrior StartPrior(const WindowState& start, const Matrix15d& covariance) {
  const int n = kCalibrationSize + kFrameSize;
  MatrixXd P = MatrixXd::Zero(n, n);
  Eigen::Matrix<double, kCalibrationSize, 1> sigma;
  sigma << Vector3d::Constant(kExtrinsicsRotationSigma),
      Vector3d::Constant(kExtrinsicsPositionSigma), kTimeOffsetSigma, kFocalSigma, kCentreSigma,
      kCentreSigma;
  P.topLeftCorner<kCalibrationSize, kCalibrationSize>() = sigma.cwiseAbs2().asDiagonal();
  P.bottomRightCorner<kFrameSize, kFrameSize>() = ToInvariant(start.frames[0].imu, covariance);
  // The start's origin and yaw are chosen, so known: 0.1 mm and 0.1 mrad keep the matrix
  // invertible.
  P.diagonal().segment<kPoseSize>(kCalibrationSize).array() += 1e-8;
  WindowPrior prior;
  prior.at = start;
  prior.H = P.llt().solve(MatrixXd::Identity(n, n));
  prior.g.setZero(n);
  return prior;
}

WindowPrior MovingStartPrior(const WindowState& start) {
  Eigen::Matrix<double, 15, 1> sigma;
  sigma << Vector3d(kTiltSigma, kTiltSigma, 0), Vector3d::Zero(),
      Vector3d::Constant(kVelocitySigma), Vector3d::Constant(kGyroBiasSigma),
      Vector3d::Constant(kAccelBiasSigma);
  WindowPrior prior = StartPrior(start, sigma.cwiseAbs2().asDiagonal());
  prior.at.frames[0].imu.accel_bias.setZero();
  return prior;
}

}  // namespace pangea::vio

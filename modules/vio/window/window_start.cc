#include "vio/window/window_start.h"

#include <Eigen/Cholesky>

namespace pangea::vio {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Matrix15d = Eigen::Matrix<double, 15, 15>;

constexpr double kRoughDistortion = 0.001;
constexpr double kIntervalShareSigma = 0.3;  // a stamp of the exposure's start or end is +-1/2
constexpr double kExactScale = 1e-5;  // remaining sigma of an exact IMU's scale factors and axes

// Prior of a moving start: almost no information on tilt and velocity.
constexpr double kTiltSigma = 0.5;       // rad
constexpr double kVelocitySigma = 5;     // m/s
constexpr double kGyroBiasSigma = 0.05;  // rad/s, about the bias that was found

// The rule is that of CalibrationSigmas::distortion.
double DistortionSigma(const CameraModel& camera, const CalibrationSigmas& given) {
  constexpr double kMeasured = 0.0003, kNotMeasured = 0.1;
  return given.distortion > 0 ? given.distortion
                              : (camera.distortion.isZero() ? kNotMeasured : kMeasured);
}

// Each sensor has its own gains and axes; the gyro's axes define the body's.
Eigen::Matrix<double, kImuIntrinsicsSize, kImuIntrinsicsSize> ImuIntrinsicsCovariance(
    const ImuNoise& noise) {
  ImuIntrinsics sigma;
  sigma.gyro.setConstant(noise.axes_sigma);
  sigma.gyro.diagonal().setConstant(noise.gyro_scale_sigma);
  sigma.accel.setConstant(noise.axes_sigma);
  sigma.accel.diagonal().setConstant(noise.accel_scale_sigma);
  Eigen::Matrix<double, kImuIntrinsicsSize, kImuIntrinsicsSize> J;
  for (int i = 0; i < kImuIntrinsicsSize; ++i) {
    ImuIntrinsics one;
    one.Add(Eigen::Matrix<double, kImuIntrinsicsSize, 1>::Unit(i));
    J.col(i) = one.OfGyroAxes().Stacked();
  }
  Eigen::Matrix<double, kImuIntrinsicsSize, kImuIntrinsicsSize> P =
      J * sigma.Stacked().cwiseAbs2().asDiagonal() * J.transpose();
  P.diagonal().array() += kExactScale * kExactScale;
  return P;
}

// Converts a covariance of (dtheta, dp, dv) to right-invariant errors: xi = d - dtheta x value.
Matrix15d ToInvariant(const ImuState& imu, const Matrix15d& covariance) {
  Matrix15d J = Matrix15d::Identity();
  J.block<3, 3>(kPosition, kTheta) = Hat(imu.T_odom_body.t);
  J.block<3, 3>(kVelocity, kTheta) = Hat(imu.v_odom_body);
  return J * covariance * J.transpose();
}

}  // namespace

bool IsRough(const CameraModel& camera, const CalibrationSigmas& given) {
  return DistortionSigma(camera, given) > kRoughDistortion;
}

WindowPrior StartPrior(const WindowState& start, const Matrix15d& covariance,
                       const CameraModel& camera, const CalibrationSigmas& given,
                       const ImuNoise& noise) {
  const int n = kSharedSize + kFrameSize;
  MatrixXd P = MatrixXd::Zero(n, n);
  const double distortion = DistortionSigma(camera, given);
  Eigen::Matrix<double, kCalibrationSize, 1> sigma;
  sigma << Vector3d::Constant(given.rotation), Vector3d::Constant(given.position_m),
      given.time_offset_s, given.focal, given.centre, given.centre, distortion, distortion,
      kIntervalShareSigma;
  P.topLeftCorner<kCalibrationSize, kCalibrationSize>() = sigma.cwiseAbs2().asDiagonal();
  P.block<kImuIntrinsicsSize, kImuIntrinsicsSize>(kImuIntrinsics, kImuIntrinsics) =
      ImuIntrinsicsCovariance(noise);
  P.bottomRightCorner<kFrameSize, kFrameSize>() = ToInvariant(start.frames[0].imu, covariance);
  // Origin and yaw of the start are chosen and so exactly known; sigmas of 0.1 mm and 0.1 mrad keep
  // the matrix invertible.
  P.diagonal().segment<kPoseSize>(kSharedSize).array() += 1e-8;
  WindowPrior prior;
  prior.at = start;
  prior.H.setZero(start.size(), start.size());  // no information on the stamp's error
  prior.H.topLeftCorner(n, n) = P.llt().solve(MatrixXd::Identity(n, n));
  prior.g.setZero(start.size());
  return prior;
}

WindowPrior MovingStartPrior(const WindowState& start, const CameraModel& camera,
                             const CalibrationSigmas& given, const ImuNoise& noise,
                             double accel_bias_sigma) {
  Eigen::Matrix<double, 15, 1> sigma;
  sigma << Vector3d(kTiltSigma, kTiltSigma, 0), Vector3d::Zero(),
      Vector3d::Constant(kVelocitySigma), Vector3d::Constant(kGyroBiasSigma),
      Vector3d::Constant(accel_bias_sigma);
  WindowPrior prior = StartPrior(start, sigma.cwiseAbs2().asDiagonal(), camera, given, noise);
  prior.at.frames[0].imu.accel_bias.setZero();
  return prior;
}

}  // namespace pangea::vio

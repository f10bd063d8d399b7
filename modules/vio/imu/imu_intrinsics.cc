#include "vio/imu/imu_intrinsics.h"

#include "core/rigid3.h"

namespace pangea::vio {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using ImuIntrinsicsVector = Eigen::Matrix<double, kImuIntrinsicsSize, 1>;

ImuIntrinsicsVector Moved(const ScaledPreintegration& span, const ImuIntrinsics& intrinsics) {
  return intrinsics.Stacked() - span.intrinsics.Stacked();
}

}  // namespace

ImuSample ImuIntrinsics::Corrected(const ImuSample& sample) const {
  return {sample.utime, sample.gyro + gyro * sample.gyro, sample.accel + accel * sample.accel};
}

ImuIntrinsicsVector ImuIntrinsics::Stacked() const {
  ImuIntrinsicsVector stacked;
  stacked << gyro.reshaped(), accel.reshaped();
  return stacked;
}

void ImuIntrinsics::Add(const ImuIntrinsicsVector& error) {
  gyro += error.head<9>().reshaped(3, 3);
  accel += error.tail<9>().reshaped(3, 3);
}

ImuIntrinsics ImuIntrinsics::OfGyroAxes() const {
  const Matrix3d rotation = 0.5 * (gyro - gyro.transpose());
  return {gyro - rotation, accel - rotation};
}

ScaledPreintegration IntegrateScaled(std::span<const ImuSample> samples, const ImuNoise& noise,
                                     const ImuIntrinsics& intrinsics, const Vector3d& gyro_bias,
                                     const Vector3d& accel_bias) {
  Preintegrator integrator(noise, gyro_bias, accel_bias);
  ScaledPreintegration span;
  span.intrinsics = intrinsics;
  for (size_t i = 0; i + 1 < samples.size(); ++i) {
    const ImuSample& a = samples[i];
    const ImuSample& b = samples[i + 1];
    const Preintegrator::Step step =
        integrator.Add(intrinsics.Corrected(a), intrinsics.Corrected(b));
    const Vector3d gyro = 0.5 * (a.gyro + b.gyro);
    const Vector3d accel = 0.5 * (a.accel + b.accel);
    span.jacobian = step.Propagate(span.jacobian);
    for (int k = 0; k < 3; ++k) {
      span.jacobian.middleCols<3>(3 * k) += gyro[k] * step.B.leftCols<3>();
      span.jacobian.middleCols<3>(9 + 3 * k) += accel[k] * step.B.rightCols<3>();
    }
  }
  span.measured = integrator.result();
  return span;
}

Preintegration At(const ScaledPreintegration& span, const ImuIntrinsics& intrinsics) {
  const Eigen::Matrix<double, 9, 1> d = span.jacobian * Moved(span, intrinsics);
  Preintegration measured = span.measured;
  measured.delta_q = (measured.delta_q * ExpSo3(d.head<3>())).normalized();
  measured.delta_v += d.segment<3>(3);
  measured.delta_p += d.tail<3>();
  return measured;
}

Eigen::Matrix<double, 15, kImuIntrinsicsSize> ImuIntrinsicsJacobian(
    const ScaledPreintegration& span, const ImuIntrinsics& intrinsics, const Vector3d& gyro_bias,
    const Vector3d& r_theta) {
  const Vector3d rotated_by_bias =
      span.measured.bias_jacobian.topLeftCorner<3, 3>() * (gyro_bias - span.measured.gyro_bias);
  const Vector3d rotated_by_intrinsics = span.jacobian.topRows<3>() * Moved(span, intrinsics);
  // dR Exp(s) Exp(b): a change of s, moved to the right end, is rotated by Exp(-b).
  const Matrix3d rotation = -RightJacobianInverse(-r_theta) *
                            ExpSo3(-rotated_by_bias).toRotationMatrix() *
                            RightJacobian(rotated_by_intrinsics);
  Eigen::Matrix<double, 15, kImuIntrinsicsSize> J =
      Eigen::Matrix<double, 15, kImuIntrinsicsSize>::Zero();
  J.topRows<3>() = rotation * span.jacobian.topRows<3>();
  J.middleRows<6>(3) = -span.jacobian.bottomRows<6>();
  return J;
}

}  // namespace pangea::vio

#include "vio/imu/imu_scales.h"

#include "core/rigid3.h"

namespace pangea::vio {
namespace {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using ScalesVector = Eigen::Matrix<double, kScalesSize, 1>;

ScalesVector Moved(const ScaledPreintegration& span, const ImuScales& scales) {
  return scales.Stacked() - span.scales.Stacked();
}

}  // namespace

ImuSample ImuScales::Corrected(const ImuSample& sample) const {
  return {sample.utime, sample.gyro + gyro * sample.gyro, sample.accel + accel * sample.accel};
}

ScalesVector ImuScales::Stacked() const {
  ScalesVector stacked;
  stacked << gyro.reshaped(), accel.reshaped();
  return stacked;
}

void ImuScales::Add(const ScalesVector& error) {
  gyro += error.head<9>().reshaped(3, 3);
  accel += error.tail<9>().reshaped(3, 3);
}

ImuScales ImuScales::OfGyroAxes() const {
  const Matrix3d turn = 0.5 * (gyro - gyro.transpose());
  return {gyro - turn, accel - turn};
}

ScaledPreintegration IntegrateScaled(std::span<const ImuSample> samples, const ImuNoise& noise,
                                     const ImuScales& scales, const Vector3d& gyro_bias,
                                     const Vector3d& accel_bias) {
  Preintegrator integrator(noise, gyro_bias, accel_bias);
  ScaledPreintegration span;
  span.scales = scales;
  for (size_t i = 0; i + 1 < samples.size(); ++i) {
    const ImuSample& a = samples[i];
    const ImuSample& b = samples[i + 1];
    const Preintegrator::Step step = integrator.Add(scales.Corrected(a), scales.Corrected(b));
    const Vector3d gyro = 0.5 * (a.gyro + b.gyro);
    const Vector3d accel = 0.5 * (a.accel + b.accel);
    span.jacobian = step.A * span.jacobian;
    for (int k = 0; k < 3; ++k) {
      span.jacobian.middleCols<3>(3 * k) += gyro[k] * step.B.leftCols<3>();
      span.jacobian.middleCols<3>(9 + 3 * k) += accel[k] * step.B.rightCols<3>();
    }
  }
  span.measured = integrator.result();
  return span;
}

Preintegration At(const ScaledPreintegration& span, const ImuScales& scales) {
  const Eigen::Matrix<double, 9, 1> d = span.jacobian * Moved(span, scales);
  Preintegration measured = span.measured;
  measured.delta_q = (measured.delta_q * ExpSo3(d.head<3>())).normalized();
  measured.delta_v += d.segment<3>(3);
  measured.delta_p += d.tail<3>();
  return measured;
}

Eigen::Matrix<double, 15, kScalesSize> ScalesJacobian(const ScaledPreintegration& span,
                                                      const ImuScales& scales,
                                                      const Vector3d& gyro_bias,
                                                      const Vector3d& r_theta) {
  const Vector3d turned_by_bias =
      span.measured.bias_jacobian.topLeftCorner<3, 3>() * (gyro_bias - span.measured.gyro_bias);
  const Vector3d turned_by_scales = span.jacobian.topRows<3>() * Moved(span, scales);
  // dR Exp(s) Exp(b): what moves s moves what is right of it by Exp(-b).
  const Matrix3d turn = -RightJacobianInverse(-r_theta) *
                        ExpSo3(-turned_by_bias).toRotationMatrix() *
                        RightJacobian(turned_by_scales);
  Eigen::Matrix<double, 15, kScalesSize> J = Eigen::Matrix<double, 15, kScalesSize>::Zero();
  J.topRows<3>() = turn * span.jacobian.topRows<3>();
  J.middleRows<6>(3) = -span.jacobian.bottomRows<6>();
  return J;
}

}  // namespace pangea::vio

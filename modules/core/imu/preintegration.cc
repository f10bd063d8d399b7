#include "core/imu/preintegration.h"

#include <algorithm>

#include "core/rigid3.h"

namespace pangea {

Preintegrator::Preintegrator(const ImuNoise& noise, const Eigen::Vector3d& gyro_bias,
                             const Eigen::Vector3d& accel_bias)
    : noise_(noise) {
  result_.gyro_bias = gyro_bias;
  result_.accel_bias = accel_bias;
}

Preintegrator::Step Preintegrator::Add(const ImuSample& a, const ImuSample& b) {
  Step out;
  const double dt = 1e-6 * static_cast<double>(b.utime - a.utime);
  if (dt <= 0) {
    return out;
  }
  Preintegration& p = result_;
  const Eigen::Vector3d omega = 0.5 * (a.gyro + b.gyro) - p.gyro_bias;
  // The specific force at the middle of the interval, rotated by half of the interval's rotation.
  const Eigen::Vector3d accel = 0.5 * (a.accel + b.accel) - p.accel_bias;
  const Eigen::Quaterniond half = ExpSo3(0.5 * dt * omega);
  const Eigen::Matrix3d R_mid = (p.delta_q * half).toRotationMatrix();
  const Eigen::Quaterniond step = ExpSo3(dt * omega);
  const Eigen::Matrix3d R_hat = R_mid * Hat(accel);
  const Eigen::Matrix3d half_R = half.toRotationMatrix();

  // Error transition, order (rotation, velocity, position): Forster et al., appendix, with the
  // force taken at the middle.
  Eigen::Matrix<double, 9, 9>& A = out.A;
  const Eigen::Matrix3d dv_dtheta = -R_hat * half_R.transpose() * dt;
  A.block<3, 3>(0, 0) = step.toRotationMatrix().transpose();
  A.block<3, 3>(3, 0) = dv_dtheta;
  A.block<3, 3>(6, 0) = 0.5 * dt * dv_dtheta;
  A.block<3, 3>(6, 3) = dt * Eigen::Matrix3d::Identity();

  Eigen::Matrix<double, 9, 6>& B = out.B;  // wrt (gyro, accel)
  const Eigen::Matrix3d dtheta_dgyro = RightJacobian(dt * omega) * dt;
  const Eigen::Matrix3d dv_dgyro = -R_hat * RightJacobian(0.5 * dt * omega) * 0.5 * dt * dt;
  B.block<3, 3>(0, 0) = dtheta_dgyro;
  B.block<3, 3>(3, 0) = dv_dgyro;
  B.block<3, 3>(6, 0) = 0.5 * dt * dv_dgyro;
  B.block<3, 3>(3, 3) = R_mid * dt;
  B.block<3, 3>(6, 3) = R_mid * (0.5 * dt * dt);

  Eigen::Matrix<double, 6, 1> noise;  // white noise density to variance over dt
  noise.head<3>().setConstant(noise_.gyro_noise_density * noise_.gyro_noise_density / dt);
  noise.tail<3>().setConstant(noise_.accel_noise_density * noise_.accel_noise_density / dt);
  const Eigen::Matrix<double, 9, 9> moved = out.Propagate(p.covariance).transpose();
  p.covariance = out.Propagate(moved) + (B * noise.asDiagonal()).lazyProduct(B.transpose());
  p.bias_jacobian = out.Propagate(p.bias_jacobian) - B;

  const Eigen::Vector3d dv = R_mid * accel * dt;
  p.delta_p += p.delta_v * dt + 0.5 * dt * dv;
  p.delta_v += dv;
  p.delta_q = (p.delta_q * step).normalized();
  p.duration_s += dt;
  return out;
}

void Preintegrator::Add(std::span<const ImuSample> samples) {
  for (size_t i = 0; i + 1 < samples.size(); ++i) {
    Add(samples[i], samples[i + 1]);
  }
}

CorrectedDelta CorrectForBias(const Preintegration& p, const Eigen::Vector3d& gyro_bias,
                              const Eigen::Vector3d& accel_bias) {
  Eigen::Matrix<double, 6, 1> db;
  db << gyro_bias - p.gyro_bias, accel_bias - p.accel_bias;
  const Eigen::Matrix<double, 9, 1> d = p.bias_jacobian * db;
  return {(p.delta_q * ExpSo3(d.head<3>())).normalized(), p.delta_v + d.segment<3>(3),
          p.delta_p + d.tail<3>()};
}

Preintegration Compose(const Preintegration& first, const Preintegration& second) {
  const CorrectedDelta next = CorrectForBias(second, first.gyro_bias, first.accel_bias);
  const Eigen::Matrix3d R = first.delta_q.toRotationMatrix();
  Preintegration both = first;
  both.duration_s += second.duration_s;
  both.delta_q = (first.delta_q * next.q).normalized();
  both.delta_v += R * next.v;
  both.delta_p += second.duration_s * first.delta_v + R * next.p;
  // How the errors of each part act on the composed motion, order (rotation, velocity, position).
  Eigen::Matrix<double, 9, 9> of_first = Eigen::Matrix<double, 9, 9>::Identity();
  of_first.block<3, 3>(0, 0) = next.q.toRotationMatrix().transpose();
  of_first.block<3, 3>(3, 0) = -R * Hat(next.v);
  of_first.block<3, 3>(6, 0) = -R * Hat(next.p);
  of_first.block<3, 3>(6, 3) = second.duration_s * Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 9, 9> of_second = Eigen::Matrix<double, 9, 9>::Identity();
  of_second.block<3, 3>(3, 3) = of_second.block<3, 3>(6, 6) = R;
  both.covariance = of_first * first.covariance * of_first.transpose() +
                    of_second * second.covariance * of_second.transpose();
  both.bias_jacobian = of_first * first.bias_jacobian + of_second * second.bias_jacobian;
  return both;
}

ImuSample InterpolateImu(const ImuSample& a, const ImuSample& b, int64_t utime) {
  const double share = b.utime > a.utime ? static_cast<double>(utime - a.utime) /
                                               static_cast<double>(b.utime - a.utime)
                                         : 0.0;
  return {utime, a.gyro + share * (b.gyro - a.gyro), a.accel + share * (b.accel - a.accel)};
}

std::vector<ImuSample> SamplesBetween(std::span<const ImuSample> samples, int64_t from_utime,
                                      int64_t to_utime) {
  const auto after = std::partition_point(
      samples.begin(), samples.end(),
      [from_utime](const ImuSample& sample) { return sample.utime <= from_utime; });
  std::vector<ImuSample> between;
  for (size_t i = std::max<size_t>(1, after - samples.begin()); i < samples.size(); ++i) {
    const ImuSample& a = samples[i - 1];
    const ImuSample& b = samples[i];
    if (a.utime >= to_utime) {
      break;
    }
    if (between.empty()) {
      between.push_back(a.utime < from_utime ? InterpolateImu(a, b, from_utime) : a);
    }
    between.push_back(b.utime > to_utime ? InterpolateImu(a, b, to_utime) : b);
  }
  if (!between.empty() && between.back().utime < to_utime) {
    between.push_back(between.back());
    between.back().utime = to_utime;
  }
  return between;
}

}  // namespace pangea

#pragma once

// IMU preintegration between two frames, on the manifold (Forster et al., TRO 2017, section VI).

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "core/imu/imu.h"

namespace pangea {

// In the body frame of the first of the two frames, gravity not included. Error-state order of
// covariance and Jacobian rows: (rotation, velocity, position), rotation perturbed on the right;
// columns of the Jacobian: (gyro bias, accel bias).
struct Preintegration {
  double duration_s = 0;
  Eigen::Quaterniond delta_q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d delta_v = Eigen::Vector3d::Zero();  // m/s
  Eigen::Vector3d delta_p = Eigen::Vector3d::Zero();  // m
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
  Eigen::Matrix<double, 9, 6> bias_jacobian = Eigen::Matrix<double, 9, 6>::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   // rad/s, linearisation point
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  // m/s^2
};

// Builds one from consecutive samples.
class Preintegrator {
 public:
  Preintegrator(const ImuNoise& noise, const Eigen::Vector3d& gyro_bias,
                const Eigen::Vector3d& accel_bias);
  // What a step does to the errors before it, and what errors of gyro and accelerometer in it do.
  struct Step {
    Eigen::Matrix<double, 9, 9> A = Eigen::Matrix<double, 9, 9>::Identity();
    Eigen::Matrix<double, 9, 6> B = Eigen::Matrix<double, 9, 6>::Zero();

    // A M, without the zeros and ones of A.
    template <int kColumns>
    Eigen::Matrix<double, 9, kColumns> Propagate(
        const Eigen::Matrix<double, 9, kColumns>& M) const {
      Eigen::Matrix<double, 9, kColumns> out = M;
      out.template topRows<3>().noalias() =
          A.topLeftCorner<3, 3>().lazyProduct(M.template topRows<3>());
      out.template bottomRows<6>().noalias() +=
          A.bottomLeftCorner<6, 3>().lazyProduct(M.template topRows<3>());
      out.template bottomRows<3>() += A(6, 3) * M.template middleRows<3>(3);
      return out;
    }
  };
  // Motion from `a` to `b`: the mean of the two samples holds in between. Samples must be in order.
  Step Add(const ImuSample& a, const ImuSample& b);
  // Motion from the first of them to the last.
  void Add(std::span<const ImuSample> samples);
  const Preintegration& result() const { return result_; }

 private:
  ImuNoise noise_;
  Preintegration result_;
};

// First-order change of the measurement when the biases move away from where it was linearised.
struct CorrectedDelta {
  Eigen::Quaterniond q;
  Eigen::Vector3d v;
  Eigen::Vector3d p;
};
CorrectedDelta CorrectForBias(const Preintegration& preintegration,
                              const Eigen::Vector3d& gyro_bias, const Eigen::Vector3d& accel_bias);

// The motion of `first` and then of `second`, linearised at the biases of `first`.
Preintegration Compose(const Preintegration& first, const Preintegration& second);

// The sample at `utime` between two others, linear.
ImuSample InterpolateImu(const ImuSample& a, const ImuSample& b, int64_t utime);

// The samples of a span of time, its ends interpolated. The last one holds when they end too early;
// when they begin too late, so does the span.
std::vector<ImuSample> SamplesBetween(std::span<const ImuSample> samples, int64_t from_utime,
                                      int64_t to_utime);

}  // namespace pangea

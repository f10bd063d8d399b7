#pragma once

// IMU preintegration between two frames, on the manifold (Forster et al., TRO 2017, section VI).

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "core/imu/imu.h"

namespace pangea {

// The motion between two frames, in the body frame of the first one, without gravity. Covariance
// and Jacobian rows have the order (rotation, velocity, position), with the rotation perturbed on
// the right. Columns of the Jacobian: (gyro bias, accel bias).
struct Preintegration {
  double duration_s = 0;
  Eigen::Quaterniond delta_q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d delta_v = Eigen::Vector3d::Zero();  // m/s
  Eigen::Vector3d delta_p = Eigen::Vector3d::Zero();  // m
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();
  Eigen::Matrix<double, 9, 6> bias_jacobian = Eigen::Matrix<double, 9, 6>::Zero();
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   // rad/s, linearisation point
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  // m/s^2, linearisation point
};

// Builds a Preintegration from consecutive samples.
class Preintegrator {
 public:
  Preintegrator(const ImuNoise& noise, const Eigen::Vector3d& gyro_bias,
                const Eigen::Vector3d& accel_bias);
  // Error propagation of one step: A acts on the error before the step, B on the errors of gyro and
  // accelerometer during the step.
  struct Step {
    Eigen::Matrix<double, 9, 9> A = Eigen::Matrix<double, 9, 9>::Identity();
    Eigen::Matrix<double, 9, 6> B = Eigen::Matrix<double, 9, 6>::Zero();

    // The product A M, computed without the known zeros and ones of A.
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
  // Adds the motion from `a` to `b`; the mean of the two samples holds in between. Samples must be
  // in order of time.
  Step Add(const ImuSample& a, const ImuSample& b);
  // Adds the motion from the first sample to the last one.
  void Add(std::span<const ImuSample> samples);
  const Preintegration& result() const { return result_; }

 private:
  ImuNoise noise_;
  Preintegration result_;
};

// The measured motion, corrected to first order for biases that differ from the linearisation
// point.
struct CorrectedDelta {
  Eigen::Quaterniond q;
  Eigen::Vector3d v;
  Eigen::Vector3d p;
};
CorrectedDelta CorrectForBias(const Preintegration& preintegration,
                              const Eigen::Vector3d& gyro_bias, const Eigen::Vector3d& accel_bias);

// The motion of `first` followed by that of `second`, linearised at the biases of `first`.
Preintegration Compose(const Preintegration& first, const Preintegration& second);

// The sample at `utime`, interpolated linearly between two others.
ImuSample InterpolateImu(const ImuSample& a, const ImuSample& b, int64_t utime);

// The samples from `from_utime` to `to_utime`, with interpolated ones at both ends. If the samples
// end too early, the last one is repeated at the end. If they begin too late, the result does too.
std::vector<ImuSample> SamplesBetween(std::span<const ImuSample> samples, int64_t from_utime,
                                      int64_t to_utime);

}  // namespace pangea

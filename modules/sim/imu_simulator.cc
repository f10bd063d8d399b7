#include "sim/imu_simulator.h"

#include <cmath>

#include "sim/random.h"

namespace pangea::sim {
namespace {

using Eigen::Vector3d;

Vector3d Normal3(Rng* rng) {
  const double x = rng->Normal();
  const double y = rng->Normal();
  return {x, y, rng->Normal()};
}

}  // namespace

SimulatedImu SimulateImu(const SplinePath& path, int64_t begin_ns, int64_t end_ns,
                         const ImuNoise& noise, bool perfect, uint64_t seed) {
  const auto period_ns = static_cast<int64_t>(std::llround(1e9 / noise.rate_hz));
  const double rate = noise.rate_hz;
  Rng rng(seed, "imu");
  // Turn-on biases of the size EuRoC's ADIS16448 shows (up to 0.08 rad/s and 0.15 m/s^2).
  constexpr double kGyroTurnOn = 0.03;
  constexpr double kAccelTurnOn = 0.08;
  Vector3d gyro_bias = kGyroTurnOn * Normal3(&rng);
  Vector3d accel_bias = kAccelTurnOn * Normal3(&rng);
  const double gyro_sigma = noise.gyro_noise_density * std::sqrt(rate);
  const double accel_sigma = noise.accel_noise_density * std::sqrt(rate);
  const Vector3d gravity(0, 0, -kGravity);

  SimulatedImu imu;
  for (int64_t stamp = begin_ns; stamp <= end_ns; stamp += period_ns) {
    const PathState state = path.At(stamp);
    ImuSample sample;
    sample.utime = UtimeFromNs(stamp);
    sample.gyro = state.omega_body;
    sample.accel = state.T_ref_body.q.conjugate() * (state.a_ref_body - gravity);
    if (perfect) {
      imu.gyro_bias.emplace_back(Vector3d::Zero());
      imu.accel_bias.emplace_back(Vector3d::Zero());
    } else {
      sample.gyro += gyro_bias + gyro_sigma * Normal3(&rng);
      sample.accel += accel_bias + accel_sigma * Normal3(&rng);
      imu.gyro_bias.push_back(gyro_bias);
      imu.accel_bias.push_back(accel_bias);
      gyro_bias += noise.gyro_random_walk / std::sqrt(rate) * Normal3(&rng);
      accel_bias += noise.accel_random_walk / std::sqrt(rate) * Normal3(&rng);
    }
    imu.stamps_ns.push_back(stamp);
    imu.samples.push_back(sample);
  }
  return imu;
}

}  // namespace pangea::sim

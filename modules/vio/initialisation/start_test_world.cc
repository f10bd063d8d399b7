#include "vio/initialisation/start_test_world.h"

#include <cmath>
#include <random>

#include "core/imu/preintegration.h"
#include "core/testing/test_random.h"

namespace pangea::vio {

using Eigen::Vector3d;

Rigid3 Lively(double t) {
  return {ExpSo3({0.3 * std::sin(2 * t), 0.25 * std::sin(1.6 * t + 1), 0.4 * std::sin(1.2 * t)}),
          {0.5 * std::sin(1.3 * t), 0.6 * std::sin(1.7 * t), 0.2 * std::sin(2.1 * t)}};
}
Rigid3 RotatingEvenly(double t) {
  return {ExpSo3({0, 0, 0.4 * t}), {0.5 * std::sin(1.3 * t), 0.6 * std::sin(1.7 * t), 0}};
}

Vector3d VelocityAt(const Path& path, double t) {
  constexpr double h = 1e-4;
  return (path(t + h).t - path(t - h).t) / (2 * h);
}

StartWorld Record(const Path& path, double late_s, double ray_sigma, double margin_s, uint64_t seed,
                  double stamp_sigma_s) {
  constexpr double h = 1e-4, kFirst_s = 1, kSpan_s = 2;
  std::mt19937_64 rng(seed), stamp_rng(seed + 1000);
  StartWorld world;
  for (double t = kFirst_s - margin_s; t <= kFirst_s + kSpan_s + margin_s + 1e-6; t += 0.005) {
    const Rigid3 now = path(t), before = path(t - h), after = path(t + h);
    const Vector3d accel = (after.t - 2 * now.t + before.t) / (h * h);
    world.samples.push_back(
        {std::llround(1e6 * t),
         LogSo3(before.q.conjugate() * after.q) / (2 * h) + kGyroBias + RandomVector(rng, 2e-3),
         now.q.conjugate() * (accel + Vector3d(0, 0, kGravity))});
  }
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Vector3d> points;
  for (int i = 0; i < 80; ++i) {
    points.emplace_back(5 + 2 * uniform(rng), 4 * uniform(rng), 3 * uniform(rng));
  }
  for (int k = 0; k <= 20; ++k) {
    StartFrame frame;
    frame.utime = std::llround(1e6 * (kFirst_s + 0.1 * k));
    const double image_s = kFirst_s + 0.1 * k + late_s + RandomVector(stamp_rng, stamp_sigma_s).x();
    const Rigid3 T_cam_odom = (path(image_s) * kT_body_cam).Inverse();
    for (int i = 0; i < 80; ++i) {
      const Vector3d p = T_cam_odom * points[i];
      const Vector3d noise = RandomVector(rng, ray_sigma);
      frame.rays[i] = p.head<2>() / p.z() + noise.head<2>();
    }
    if (k > 0) {
      frame.imu = SamplesBetween(world.samples, world.frames.back().utime, frame.utime);
    }
    world.frames.push_back(frame);
  }
  return world;
}

}  // namespace pangea::vio

#include "calibration/calibration_test_world.h"

#include <array>
#include <cmath>
#include <random>

#include "calibration/search.h"
#include "core/axis_aligned.h"
#include "core/rigid3.h"

namespace pangea::calibration {
namespace {

constexpr int kWaves = 6;
constexpr double kRows_s = 1e-3;  // step of the integration of the rotation

// A sum of sines with the given rms, 0.2 to 1.6 Hz.
class Waves {
 public:
  Waves(std::mt19937_64& rng, double rms) : amplitude_(rms * std::sqrt(2.0 / kWaves)) {
    std::uniform_real_distribution<double> hz(0.2, 1.6), phase(0, 2 * M_PI);
    for (int i = 0; i < kWaves; ++i) {
      hz_[static_cast<size_t>(i)] = hz(rng);
      phase_[static_cast<size_t>(i)] = phase(rng);
    }
  }
  double At(double t) const {
    double sum = 0;
    for (size_t i = 0; i < kWaves; ++i) {
      sum += std::sin(2 * M_PI * hz_[i] * t + phase_[i]);
    }
    return amplitude_ * sum;
  }

 private:
  double amplitude_;
  std::array<double, kWaves> hz_, phase_;
};

struct Motion {
  std::array<Waves, 3> rate;      // body, rad/s
  std::array<Waves, 3> position;  // world, m
  Eigen::Matrix3d R_body_cam;
  std::vector<Eigen::Quaterniond> q_world_body;  // every kRows_s

  Eigen::Vector3d RateAt(double t) const {
    return R_body_cam * Eigen::Vector3d(rate[0].At(t), rate[1].At(t), rate[2].At(t));
  }
  Eigen::Vector3d PositionAt(double t) const {
    return {position[0].At(t), position[1].At(t), position[2].At(t)};
  }
  Eigen::Quaterniond RotationAt(double t) const {
    const auto i = static_cast<size_t>(t / kRows_s);
    return q_world_body[i] * ExpSo3(RateAt(t) * (t - static_cast<double>(i) * kRows_s));
  }
};

Parameters RandomTruth(std::mt19937_64& rng, const TestWorldOptions& options) {
  std::uniform_real_distribution<double> u(-1, 1);
  std::normal_distribution<double> n(0, 1);
  Parameters truth;
  CameraModel& camera = truth.camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = FocalOf((67.5 + 12.5 * u(rng)) * M_PI / 180, camera);
  camera.cx = 319.5 + 6 * n(rng);
  camera.cy = 239.5 + 6 * n(rng);
  camera.distortion[0] = 0.05 * n(rng);
  camera.distortion[1] = 0.02 * n(rng);
  camera.readout_s = 0.015 + 0.012 * u(rng);
  camera.time_offset_s = 0.05 * u(rng) - 0.5 * camera.readout_s;
  const std::vector<Eigen::Quaterniond> rotations = AxisAlignedRotations();
  const Eigen::Vector3d rough(n(rng), n(rng), n(rng));
  camera.T_body_cam.q = ExpSo3(options.rough_rad / std::sqrt(3.0) * rough) *
                        rotations[static_cast<size_t>(rng() % rotations.size())];
  truth.gyro_bias = 0.02 * Eigen::Vector3d(n(rng), n(rng), n(rng));
  return truth;
}

// Observation with a rolling shutter: the row of the pixel is exposed at the time of the
// observation.
std::optional<Eigen::Vector2d> SeenAt(const Motion& motion, const CameraModel& camera,
                                      const Eigen::Vector3d& point, double image_s) {
  Eigen::Vector2d pixel(0, 0.5 * camera.height);
  for (int iteration = 0; iteration < 4; ++iteration) {
    const double t =
        image_s + camera.time_offset_s + camera.readout_s * pixel.y() / (camera.height - 1);
    const Eigen::Vector3d p_cam =
        (motion.RotationAt(t) * camera.T_body_cam.q).conjugate() * (point - motion.PositionAt(t));
    const auto seen = p_cam.z() > 0.2 ? camera.Project(p_cam) : std::nullopt;
    if (!seen || !camera.Contains(*seen, -40)) {
      return std::nullopt;
    }
    pixel = *seen;
  }
  return camera.Contains(pixel) ? std::optional(pixel) : std::nullopt;
}

void AddImu(const Motion& motion, const TestWorldOptions& options, std::mt19937_64& rng,
            TestWorld& world) {
  std::normal_distribution<double> n(
      0, options.exact_gyro ? 0
                            : world.input.imu_noise.gyro_noise_density * std::sqrt(options.imu_hz));
  for (int i = 0; i < static_cast<int>((options.seconds + 1.8) * options.imu_hz); ++i) {
    const double t = i / options.imu_hz;
    ImuSample sample;
    sample.utime = std::llround(1e6 * t);
    sample.gyro =
        motion.RateAt(t) + world.truth.gyro_bias + Eigen::Vector3d(n(rng), n(rng), n(rng));
    world.input.imu.push_back(sample);
  }
}

void AddFrames(const Motion& motion, const TestWorldOptions& options, std::mt19937_64& rng,
               TestWorld& world) {
  std::normal_distribution<double> n(0, 1);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < options.num_points; ++i) {
    const Eigen::Vector3d way(n(rng), n(rng), n(rng));
    points.push_back((4 + 2.5 * u(rng)) * way.normalized());
  }
  double interval_s = 1 / options.image_hz;
  for (double t = 0.9; t < 0.9 + options.seconds - 1e-9; t += interval_s) {
    interval_s = (t < 0.9 + 0.5 * options.seconds ? 1 : options.slower) / options.image_hz;
    const double later_s = options.interval_share * (interval_s - 1 / options.image_hz);
    vio::TrackedFrame frame;
    frame.utime = std::llround(1e6 * (t - later_s + options.stamp_sigma_s * n(rng)));
    for (size_t id = 0; id < points.size(); ++id) {
      const auto pixel = SeenAt(motion, world.truth.camera, points[id], t);
      if (pixel) {
        vio::Observation observation;
        observation.landmark_id = static_cast<int32_t>(id);
        const bool outlier =
            static_cast<double>(id) < options.outlier_share * static_cast<double>(points.size());
        const Eigen::Vector2d off = outlier ? 6 * Eigen::Vector2d(u(rng), u(rng))
                                            : options.pixel_sigma * Eigen::Vector2d(n(rng), n(rng));
        observation.pixel = (*pixel + off).cast<float>();
        frame.observations.push_back(observation);
      }
    }
    world.input.frames.push_back(frame);
  }
}

}  // namespace

TestWorld MakeTestWorld(const TestWorldOptions& options) {
  std::mt19937_64 rng(options.seed);
  TestWorld world;
  world.truth = RandomTruth(rng, options);
  world.truth.interval_share = options.interval_share;
  world.input.width = world.truth.camera.width;
  world.input.height = world.truth.camera.height;
  const Eigen::Vector3d& rms = options.rotation_rms;
  Motion motion{.rate = {Waves(rng, rms.x()), Waves(rng, rms.y()), Waves(rng, rms.z())},
                .position = {Waves(rng, 0.15), Waves(rng, 0.15), Waves(rng, 0.15)},
                .R_body_cam = world.truth.camera.T_body_cam.R(),
                .q_world_body = {Eigen::Quaterniond::Identity()}};
  for (double t = 0; t < options.seconds + 2; t += kRows_s) {
    motion.q_world_body.push_back(
        (motion.q_world_body.back() * ExpSo3(kRows_s * motion.RateAt(t + 0.5 * kRows_s)))
            .normalized());
  }
  AddImu(motion, options, rng, world);
  AddFrames(motion, options, rng, world);
  return world;
}

}  // namespace pangea::calibration

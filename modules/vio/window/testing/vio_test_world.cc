#include "vio/window/testing/vio_test_world.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/testing/test_cameras.h"
#include "core/testing/test_random.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int64_t kImuPeriod_us = 5'000;
constexpr double kDifference_s = 1e-4;  // for derivatives of the path
constexpr size_t kTracks = 100;
constexpr double kLossPerFrame = 0.02;
const Vector3d kHall(16, 12, 4);
const Vector3d kLongHall(200, 12, 4);
constexpr double kSight_m = 30;

double Seconds(int64_t utime) { return 1e-6 * static_cast<double>(utime); }

// Time along the path: passes like t, but stops in [begin, end], with smooth transitions.
double PathTime(double t, double begin, double end) {
  constexpr double kSoft = 0.5;
  if (t <= begin) {
    return t;
  }
  const double u = std::min(1.0, (t - begin) / kSoft);
  double s = begin + kSoft * (u - u * u * u + 0.5 * u * u * u * u);
  if (t > end) {
    const double w = std::min(1.0, (t - end) / kSoft);
    s += kSoft * (w * w * w - 0.5 * w * w * w * w) + std::max(0.0, t - end - kSoft);
  }
  return s;
}

// Rotation of a shaking hand, rad, for an acceleration of at most 1 rad/s^2 about each axis.
Vector3d Shake(double s) {
  const Vector3d frequency(17.3, 21.9, 19.1);  // rad/s
  const Vector3d phase(0, 1, 2);
  return ((s * frequency + phase).array().sin() / frequency.array().square()).matrix();
}

// With a generator of its own: the world is the same for an exact IMU and for another.
ImuIntrinsics RandomImuIntrinsics(const ImuNoise& noise, uint64_t seed) {
  std::mt19937_64 rng(seed);
  ImuIntrinsics imu_intrinsics;
  for (int k = 0; k < 3; ++k) {
    imu_intrinsics.gyro.col(k) = RandomVector(rng, noise.axes_sigma);
    imu_intrinsics.accel.col(k) = RandomVector(rng, noise.axes_sigma);
  }
  imu_intrinsics.gyro.diagonal() = RandomVector(rng, noise.gyro_scale_sigma);
  imu_intrinsics.accel.diagonal() = RandomVector(rng, noise.accel_scale_sigma);
  return imu_intrinsics.OfGyroAxes();
}

}  // namespace

VioTestWorld::VioTestWorld(const VioTestWorldOptions& options)
    : options_(options), rng_(options.seed), crowd_rng_(options.seed) {
  camera_ = PinholeTestCamera(640, 480, 400);
  camera_.T_body_cam = {LookingAhead() * ExpSo3(RandomVector(rng_, 0.05)),
                        RandomVector(rng_, 0.05)};
  camera_.readout_s = options.readout_s;
  true_T_body_cam_.q =
      ExpSo3(RandomVector(rng_, options.extrinsics_rotation_sigma)) * camera_.T_body_cam.q;
  true_T_body_cam_.t = camera_.T_body_cam.t + RandomVector(rng_, options.extrinsics_position_sigma);
  true_time_offset_s_ = RandomVector(rng_, options.time_offset_sigma).x();
  true_intrinsics_ = camera_;
  // a separate generator, so that the rest of the world does not change
  std::mt19937_64 intrinsics_rng(options.seed);
  const double longer = 1 + RandomVector(intrinsics_rng, options.focal_sigma).x();
  const Vector3d centre = RandomVector(intrinsics_rng, options.centre_sigma);
  true_intrinsics_.cx += camera_.fx * centre.x();
  true_intrinsics_.cy += camera_.fy * centre.y();
  true_intrinsics_.distortion[0] += options.unknown_distortion;
  true_intrinsics_.fx *= longer;
  true_intrinsics_.fy *= longer;
  ImuNoise intrinsics_noise = options.imu_noise;
  intrinsics_noise.gyro_scale_sigma *= options.imu_intrinsics_sigmas;
  intrinsics_noise.accel_scale_sigma *= options.imu_intrinsics_sigmas;
  intrinsics_noise.axes_sigma *= options.imu_intrinsics_sigmas;
  true_imu_intrinsics_ = RandomImuIntrinsics(intrinsics_noise, options.seed + 1000);
  phase_ = RandomVector(rng_, 2);
  gyro_bias_ = RandomVector(rng_, 0.02);
  accel_bias_ = RandomVector(rng_, 0.05);
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  const Vector3d& hall = options.drive_mps > 0 ? kLongHall : kHall;
  for (int i = 0; i < 1500; ++i) {
    Vector3d p(uniform(rng_), uniform(rng_), uniform(rng_));
    p[i % 3] = p[i % 3] < 0 ? -0.5 : 0.5;
    points_.push_back(p.cwiseProduct(hall) + Vector3d(0, 0, 0.5 * hall.z()));
  }
}

Rigid3 VioTestWorld::PoseAt(double t) const {
  const double s = PathTime(t, options_.stationary_begin_s, options_.stationary_end_s);
  const Vector3d walk(3 * std::sin(0.45 * s + phase_.x()), 2.2 * std::sin(0.6 * s + phase_.y()),
                      1.6 + 0.25 * std::sin(0.8 * s + phase_.z()));
  const Vector3d hand(0.02 * std::sin(9.1 * s), 0.02 * std::sin(7.7 * s + 1),
                      0.03 * std::sin(11.3 * s + 2));
  if (options_.drive_mps > 0) {
    const Vector3d ahead(options_.drive_mps * s, 0.2 * std::sin(0.5 * s), 1.6);
    return {ExpSo3(0.2 * hand), ahead + 0.3 * hand};
  }
  if (options_.spin_rps > 0) {
    return {YawRotation(options_.spin_rps * s) * ExpSo3(2 * hand), Vector3d(1, 1, 1.6) + hand};
  }
  const Vector3d rotation(0.08 * std::sin(1.3 * s + phase_.y()),
                          0.12 * std::sin(1.1 * s + phase_.z()),
                          0.25 * s + 0.5 * std::sin(0.7 * s + phase_.x()));
  const Eigen::Quaterniond q = YawRotation(rotation.z()) * ExpSo3(Vector3d(0, rotation.y(), 0)) *
                               ExpSo3(Vector3d(rotation.x(), 0, 0)) *
                               ExpSo3(options_.shake_radps2 * Shake(s));
  return {q, walk + hand};
}

Vector3d VioTestWorld::VelocityAt(double t) const {
  return (PoseAt(t + kDifference_s).t - PoseAt(t - kDifference_s).t) / (2 * kDifference_s);
}

ImuSample VioTestWorld::SampleAt(int64_t utime) {
  const double t = Seconds(utime);
  const Rigid3 before = PoseAt(t - kDifference_s), now = PoseAt(t),
               after = PoseAt(t + kDifference_s);
  const Vector3d omega = LogSo3(before.q.conjugate() * after.q) / (2 * kDifference_s);
  const Vector3d accel = (after.t - 2 * now.t + before.t) / (kDifference_s * kDifference_s);
  const ImuNoise& noise = options_.imu_noise;
  const double dt = Seconds(kImuPeriod_us);
  gyro_bias_ += RandomVector(rng_, noise.gyro_random_walk * std::sqrt(dt));
  accel_bias_ += RandomVector(rng_, noise.accel_random_walk * std::sqrt(dt));
  biases_[utime] = {gyro_bias_, accel_bias_};
  const Vector3d gyro =
      omega + gyro_bias_ + RandomVector(rng_, noise.gyro_noise_density / std::sqrt(dt));
  const Vector3d force = now.q.conjugate() * (accel + Vector3d(0, 0, kGravity)) + accel_bias_ +
                         RandomVector(rng_, noise.accel_noise_density / std::sqrt(dt));
  const Matrix3d I = Matrix3d::Identity();
  return {utime, (I + true_imu_intrinsics_.gyro).inverse() * gyro,
          (I + true_imu_intrinsics_.accel).inverse() * force};
}

std::optional<Vector2d> VioTestWorld::SeenFrom(const Rigid3& T_odom_cam,
                                               const Vector3d& point) const {
  const Vector3d p_cam = T_odom_cam.Inverse() * point;
  if (p_cam.z() < 0.3 || p_cam.z() > kSight_m) {
    return std::nullopt;
  }
  const auto pixel = true_intrinsics_.Project(p_cam);
  return pixel && camera_.Contains(*pixel, 5) ? pixel : std::nullopt;
}

std::optional<Vector2d> VioTestWorld::Seen(const Vector3d& point, double t) const {
  constexpr int kIterations = 3;  // each leaves some 3 % of the error
  auto pixel = SeenFrom(PoseAt(t) * true_T_body_cam_, point);
  for (int i = 0; pixel && options_.readout_s > 0 && i < kIterations; ++i) {
    const double row_s = camera_.RowTime_s(pixel->y());
    pixel = SeenFrom(PoseAt(t + row_s) * true_T_body_cam_, point);
  }
  return pixel;
}

// Moves to the right of the camera's direction at the time when the crowd starts to move.
Vector3d VioTestWorld::CrowdMoved(double t) const {
  const Eigen::Quaterniond q = PoseAt(options_.crowd_moves_s).q * true_T_body_cam_.q;
  Vector3d right = q * Vector3d::UnitX();
  right.z() = 0;
  const double moving_s = std::max(0.0, t - options_.crowd_moves_s);
  const double soft_s = options_.crowd_sets_off ? options_.crowd_mps : 0;  // 1 m/s^2
  const double distance = moving_s < soft_s ? 0.5 * moving_s * moving_s
                                            : options_.crowd_mps * moving_s - 0.5 * soft_s * soft_s;
  return distance * right.normalized();
}

void VioTestWorld::ObserveCrowd(double t) {
  const bool is_there = t >= options_.crowd_comes_s && t < options_.crowd_end_s;
  const auto wanted = static_cast<size_t>(
      is_there ? std::lround(options_.crowd_share * static_cast<double>(kTracks)) : 0);
  const Vector3d moved = CrowdMoved(t);
  const Rigid3 T_odom_cam = PoseAt(t) * true_T_body_cam_;
  std::erase_if(tracks_, [&](const auto& item) {
    return item.second.in_crowd && (wanted == 0 || !Seen(item.second.point + moved, t));
  });
  const auto in_crowd = [](const auto& item) { return item.second.in_crowd; };
  auto count = static_cast<size_t>(std::count_if(tracks_.begin(), tracks_.end(), in_crowd));
  if (count == 0 && wanted > 0) {  // the crowd hides the points behind it
    std::bernoulli_distribution hidden(options_.crowd_share);
    std::erase_if(tracks_, [&](const auto&) { return hidden(crowd_rng_); });
  }
  std::uniform_real_distribution<double> x(5, camera_.width - 6), y(5, camera_.height - 6);
  std::uniform_real_distribution<double> depth(2, 4);
  for (; count < wanted; ++count) {
    const Vector2d pixel(x(crowd_rng_), y(crowd_rng_));
    const Vector2d ray = *true_intrinsics_.Unproject(pixel);
    Track track;
    track.point = T_odom_cam * (depth(crowd_rng_) * ray.homogeneous()) - moved;
    track.in_crowd = true;
    tracks_[next_id_] = track;
    all_tracks_[next_id_] = track;
    ++next_id_;
  }
}

TrackedFrame VioTestWorld::Observe(int64_t utime) {
  const double t = Seconds(utime) + true_time_offset_s_;
  std::uniform_real_distribution<double> uniform;
  std::erase_if(tracks_, [&](const auto& item) {
    return !item.second.in_crowd && (!Seen(item.second.point, t) || uniform(rng_) < kLossPerFrame);
  });
  if (options_.crowd_share > 0) {
    ObserveCrowd(t);
  }
  const Vector3d moved = CrowdMoved(t);
  for (int tries = 0; tracks_.size() < kTracks && tries < 5000; ++tries) {
    const Vector3d& point = points_[rng_() % points_.size()];
    const bool taken = std::any_of(tracks_.begin(), tracks_.end(),
                                   [&](const auto& item) { return item.second.point == point; });
    if (!taken && Seen(point, t)) {
      Track track{point};
      track.slides = uniform(rng_) < options_.outlier_share;
      track.velocity = RandomVector(rng_, 2.0).head<2>();
      tracks_[next_id_] = track;
      all_tracks_[next_id_] = track;
      ++next_id_;
    }
  }
  TrackedFrame frame{utime, {}};
  for (auto& [id, track] : tracks_) {
    const Vector3d point = track.in_crowd ? Vector3d(track.point + moved) : track.point;
    Vector2d pixel = *Seen(point, t) + RandomVector(rng_, options_.pixel_noise).head<2>();
    if (track.slides) {
      track.slid += track.velocity;
      pixel += track.slid;
    }
    frame.observations.push_back({id, pixel.cast<float>(), *camera_.Unproject(pixel), 1.0});
  }
  return frame;
}

VioTestWorld::Input VioTestWorld::Next() {
  Input input;
  input.taken_utime = next_frame_utime_;
  // a separate one, so that the world does not change
  std::mt19937_64 rng(options_.seed + next_frame_utime_);
  const int64_t stamp =
      next_frame_utime_ + std::llround(1e6 * RandomVector(rng, options_.stamp_jitter_s).x());
  const int64_t last_row_utime = stamp + std::llround(1e6 * options_.readout_s);
  do {
    input.imu.push_back(SampleAt(next_imu_utime_));
    next_imu_utime_ += kImuPeriod_us;
  } while (input.imu.back().utime < last_row_utime);
  input.frame = Observe(next_frame_utime_);
  input.frame.utime = stamp;
  next_frame_utime_ += std::llround(1e6 / options_.frame_rate_hz);
  return input;
}

void VioTestWorld::Drop(std::span<const int32_t> landmark_ids) {
  for (const int32_t id : landmark_ids) {
    tracks_.erase(id);
  }
}

ImuState VioTestWorld::TruthAt(int64_t frame_utime) const {
  const double t = Seconds(frame_utime) + true_time_offset_s_;
  ImuState state;
  state.T_odom_body = PoseAt(t);
  state.v_odom_body = VelocityAt(t);
  const auto bias = biases_.lower_bound(frame_utime);
  std::tie(state.gyro_bias, state.accel_bias) =
      bias == biases_.end() ? biases_.rbegin()->second : bias->second;
  return state;
}

std::optional<double> VioTestWorld::TrueDepth(int32_t landmark_id, int64_t frame_utime) const {
  const Track& track = all_tracks_.at(landmark_id);
  if (track.slides || track.in_crowd) {
    return std::nullopt;
  }
  return ((TruthAt(frame_utime).T_odom_body * true_T_body_cam_).Inverse() * track.point).z();
}

}  // namespace pangea::vio

#include "global_ba/ba_test_world.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "core/testing/test_cameras.h"
#include "core/testing/test_random.h"

namespace pangea {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSampleStep_s = 0.005;

// A lively flight around the cloud, with the camera towards its middle.
class Flight {
 public:
  Flight(int agent, double drift_m_s)
      : phase_(0.7 * agent), radius_(4 + 0.3 * agent), drift_m_s_(drift_m_s) {}

  Rigid3 Pose(double t) const {
    const double angle = 0.35 * t + phase_;
    const Vector3d p(drift_m_s_ * t + radius_ * std::cos(angle) + 0.2 * std::sin(2.1 * t),
                     radius_ * std::sin(angle) + 0.2 * std::sin(1.7 * t),
                     1.5 + 0.4 * std::sin(1.3 * t + phase_));
    const Eigen::Quaterniond nod =
        ExpSo3({0.1 * std::sin(1.9 * t), 0.1 * std::sin(2.3 * t + phase_), 0});
    return {YawRotation(angle + EIGEN_PI) * nod, p};
  }
  Vector3d Velocity(double t) const { return (Pose(t + kH).t - Pose(t - kH).t) / (2 * kH); }

  ImuSample Sample(double t) const {
    const Rigid3 before = Pose(t - kH), now = Pose(t), after = Pose(t + kH);
    const Vector3d acceleration = (after.t - 2 * now.t + before.t) / (kH * kH);
    return {std::llround(1e6 * t), LogSo3(before.q.conjugate() * after.q) / (2 * kH),
            now.q.conjugate() * (acceleration + Vector3d(0, 0, kGravity))};
  }

 private:
  static constexpr double kH = 1e-4;
  double phase_;
  double radius_;
  double drift_m_s_;
};

class Maker {
 public:
  explicit Maker(const BaTestOptions& options) : options_(options), rng_(options.seed) {}

  BaTestWorld Make() {
    for (int i = 0; i < options_.landmarks; ++i) {
      world_.landmarks.push_back(Vector3d(0, 0, 1.5) + RandomVector(rng_, 1.2));
      world_.landmarks.back().x() +=
          options_.drift_m_s * options_.step_s * options_.keyframes * i / options_.landmarks;
    }
    for (int agent = 0; agent < options_.agents; ++agent) {
      Fly(agent);
    }
    for (int i = 0; i < static_cast<int>(world_.keyframes.size()); ++i) {
      See(i);
    }
    return {world_, Start()};
  }

 private:
  void Fly(int agent) {
    const Flight flight(agent, options_.drift_m_s);
    world_.cameras.push_back({.T_body_cam = EurocTestCamera().T_body_cam});
    Vector3d gyro_bias = RandomVector(rng_, 0.01), accel_bias = RandomVector(rng_, 0.05);
    for (int k = 0; k < options_.keyframes; ++k) {
      const double t = 1 + options_.step_s * k;
      BaKeyframe& keyframe = world_.keyframes.emplace_back();
      keyframe.id = {{agent + 1, 1000}, k};
      keyframe.utime = std::llround(1e6 * t);
      keyframe.camera = agent;
      if (k > 0) {
        keyframe.previous = static_cast<int>(world_.keyframes.size()) - 2;
        if (options_.imu) {
          keyframe.preintegration = Integrate(flight, t - options_.step_s, &gyro_bias, &accel_bias);
        }
        keyframe.edge = Edge(flight.Pose(t - options_.step_s).Inverse() * flight.Pose(t));
      }
      keyframe.state = {flight.Pose(t), flight.Velocity(t), gyro_bias, accel_bias};
    }
  }

  std::optional<BaEdge> Edge(const Rigid3& T_previous_this) {
    const double sigma = options_.edge_sigma_m;
    if (sigma == 0) {
      return std::nullopt;
    }
    Vector6d error, variance;
    error << RandomVector(rng_, options_.noise * sigma),
        RandomVector(rng_, 0.1 * options_.noise * sigma);
    variance << Vector3d::Constant(sigma * sigma), Vector3d::Constant(0.01 * sigma * sigma);
    Rigid3 T_measured = T_previous_this.Plus(error);
    T_measured.t *= 1 + options_.edge_scale_error;
    return BaEdge{T_measured, variance.asDiagonal()};
  }

  // Integrated with zero bias, while the true biases do a random walk.
  Preintegration Integrate(const Flight& flight, double from_s, Vector3d* gyro_bias,
                           Vector3d* accel_bias) {
    const ImuNoise noise;
    const double step = std::sqrt(kSampleStep_s);
    Preintegrator integrator(noise, Vector3d::Zero(), Vector3d::Zero());
    std::vector<ImuSample> samples;
    const int count = static_cast<int>(std::lround(options_.step_s / kSampleStep_s));
    for (int i = 0; i <= count; ++i) {
      ImuSample sample = flight.Sample(from_s + kSampleStep_s * i);
      const double per_sample = options_.noise / step;
      sample.gyro += *gyro_bias + RandomVector(rng_, per_sample * noise.gyro_noise_density);
      sample.accel += *accel_bias + RandomVector(rng_, per_sample * noise.accel_noise_density);
      samples.push_back(sample);
      if (i < count) {
        *gyro_bias += RandomVector(rng_, options_.noise * noise.gyro_random_walk * step);
        *accel_bias += RandomVector(rng_, options_.noise * noise.accel_random_walk * step);
      }
    }
    integrator.Add(samples);
    return integrator.result();
  }

  void See(int index) {
    const BaKeyframe& keyframe = world_.keyframes[index];
    const CameraModel camera = EurocTestCamera();
    const Rigid3 T_cam_map = (keyframe.state.T_map_body * camera.T_body_cam).Inverse();
    const double sigma = options_.pixel_sigma * camera.PixelAngle();
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int i = 0; i < static_cast<int>(world_.landmarks.size()); ++i) {
      const Vector3d p_cam = T_cam_map * world_.landmarks[i];
      const auto pixel = camera.Project(p_cam);
      if (p_cam.z() < 0.5 || p_cam.z() > options_.max_depth_m || !pixel ||
          !camera.Contains(*pixel)) {
        continue;
      }
      BaObservation seen{index, i, p_cam.hnormalized(), Eigen::Matrix2d::Identity() / sigma};
      seen.ray += RandomVector(rng_, options_.noise * sigma).head<2>();
      if (uniform(rng_) < options_.outlier_share) {
        seen.ray += RandomVector(rng_, 0.05).head<2>();
      }
      world_.observations.push_back(seen);
    }
  }

  BaWorld Start() {
    BaWorld start = world_;
    const double scale = 1 + options_.scale_error;
    for (BaKeyframe& keyframe : start.keyframes) {
      KeyframeState& state = keyframe.state;
      state.T_map_body.t = scale * state.T_map_body.t + RandomVector(rng_, options_.start_sigma_m);
      state.T_map_body.q =
          ExpSo3(RandomVector(rng_, 0.1 * options_.start_sigma_m)) * state.T_map_body.q;
      state.v_map_body = scale * state.v_map_body + RandomVector(rng_, options_.start_sigma_m);
      state.gyro_bias.setZero();
      state.accel_bias.setZero();
    }
    for (Vector3d& landmark : start.landmarks) {
      landmark = scale * landmark + RandomVector(rng_, options_.start_sigma_m);
    }
    return start;
  }

  BaTestOptions options_;
  std::mt19937_64 rng_;
  BaWorld world_;
};

}  // namespace

BaTestWorld MakeBaTestWorld(const BaTestOptions& options) { return Maker(options).Make(); }

BaTestMessages MessagesOf(const BaTestWorld& world) {
  BaTestMessages messages;
  MapState& state = messages.state;
  std::vector<std::map<int, int>> corner_of(world.start.keyframes.size());  // by landmark
  for (const BaKeyframe& start : world.start.keyframes) {
    Keyframe keyframe;
    keyframe.id = start.id;
    keyframe.utime = start.utime;
    keyframe.camera = EurocTestCamera();
    keyframe.T_odom_body = start.state.T_map_body;
    keyframe.v_odom_body = start.state.v_map_body;
    if (start.previous >= 0) {
      const Rigid3& T_previous = world.start.keyframes[start.previous].state.T_map_body;
      const BaEdge of_start{T_previous.Inverse() * keyframe.T_odom_body,
                            // The start's error between successive keyframes
                            1e-3 * Matrix6d::Identity()};
      const BaEdge edge = start.edge.value_or(of_start);
      keyframe.edge = {start.id.seq - 1, edge.T_previous_this, edge.covariance};
      keyframe.preintegration = start.preintegration;
    } else {
      state.maps.push_back(start.id.map);
    }
    state.keyframes.push_back({start.id, start.utime, keyframe.T_odom_body});
    messages.keyframes.push_back(keyframe);
  }
  for (const BaObservation& seen : world.start.observations) {
    std::vector<Corner>& corners = messages.keyframes[seen.keyframe].corners;
    Corner corner;
    corner.pixel = EurocTestCamera().Project(seen.ray.homogeneous())->cast<float>();
    corner.landmark_id = seen.landmark;
    corner_of[seen.keyframe][seen.landmark] = static_cast<int>(corners.size());
    corners.push_back(corner);
  }
  state.group = state.maps.front();
  state.revision = 1;
  for (size_t i = 0; i < messages.keyframes.size(); ++i) {
    const KeyframeId& id = messages.keyframes[i].id;
    PlaceMatch match{id, {}, {}};
    if (id.map != state.group) {
      PlaceCandidate candidate{{state.group, id.seq}, PlaceKind::kInter, 1, {}};
      for (const auto& [landmark, corner] : corner_of[i]) {
        const auto there = corner_of[id.seq].find(landmark);
        if (there != corner_of[id.seq].end()) {
          candidate.corner_matches.emplace_back(corner, there->second);
        }
      }
      Constraint constraint;
      constraint.from = candidate.match;
      constraint.to = id;
      constraint.accepted = true;
      messages.constraints.push_back(constraint);
      match.candidates.push_back(candidate);
    }
    messages.matches.push_back(match);
  }
  state.num_constraints = static_cast<int>(messages.constraints.size());
  return messages;
}

double WorstError(const BaWorld& world, const BaWorld& truth) {
  const Rigid3& first = world.keyframes[0].state.T_map_body;
  const Rigid3& true_first = truth.keyframes[0].state.T_map_body;
  const Eigen::Quaterniond rotation = YawRotation(YawOf(true_first.q * first.q.conjugate()));
  double worst = 0;
  for (size_t i = 0; i < world.keyframes.size(); ++i) {
    const Vector3d p = rotation * (world.keyframes[i].state.T_map_body.t - first.t);
    worst = std::max(worst, (p - (truth.keyframes[i].state.T_map_body.t - true_first.t)).norm());
  }
  return worst;
}

double PathLength(const BaWorld& world) {
  double length = 0;
  for (const BaKeyframe& keyframe : world.keyframes) {
    if (keyframe.previous >= 0) {
      length +=
          (keyframe.state.T_map_body.t - world.keyframes[keyframe.previous].state.T_map_body.t)
              .norm();
    }
  }
  return length;
}

}  // namespace pangea

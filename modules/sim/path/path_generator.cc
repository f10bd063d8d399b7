#include "sim/path/path_generator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/imu/imu.h"
#include "sim/random.h"
#include "sim/scene/route.h"

namespace pangea::sim {
namespace {

using Eigen::Vector3d;

// A smooth wandering value in about -1 .. 1: sines of random frequencies and phases.
class Wander {
 public:
  Wander(double slowest_hz, double fastest_hz, Rng* rng) {
    for (Wave& wave : waves_) {
      wave.hz = rng->Uniform(slowest_hz, fastest_hz);
      wave.phase = rng->Uniform(0, 2 * M_PI);
    }
  }
  double At(double t) const {
    double sum = 0;
    for (const Wave& wave : waves_) {
      sum += std::sin(2 * M_PI * wave.hz * t + wave.phase);
    }
    return sum / static_cast<double>(waves_.size());
  }

 private:
  struct Wave {
    double hz = 0, phase = 0;
  };
  std::array<Wave, 4> waves_;
};

class Traveller {
 public:
  explicit Traveller(const GeneratedPathOptions& options)
      : options_(options), route_(RouteOf(options.scene)), rng_(options.seed, "path") {
    direction_ = rng_.Chance(0.5) ? 1 : -1;
    phase_ = rng_.Uniform(0, 2 * M_PI);
  }

  // Advances by dt; `go` in 0 .. 1 scales the speed.
  void Step(double dt, double go) {
    time_ += go * dt;
    const double hall = IsHall(options_.scene) ? 1.0 : 0.45;
    const double cruise = hall * (options_.motion == Motion::kWalk ? 1.1 : 1.8);
    const double speed = cruise * (1 + 0.35 * speed_.At(time_));
    const Eigen::Vector2d tangent = (route_.At(phase_ + 1e-4) - route_.At(phase_ - 1e-4)) / 2e-4;
    phase_ += direction_ * go * dt * speed / tangent.norm();
    heading_ = std::atan2(direction_ * tangent.y(), direction_ * tangent.x());
  }

  Vector3d Position() const {
    const Eigen::Vector2d centre = route_.At(phase_);
    const double middle = 0.5 * (route_.low_m + route_.high_m);
    const double reach = 0.5 * (route_.high_m - route_.low_m);
    Vector3d p(centre.x() + route_.sideways_m * x_.At(time_),
               centre.y() + route_.sideways_m * y_.At(time_), middle + 0.9 * reach * z_.At(time_));
    if (options_.motion == Motion::kWalk) {
      // Held at chest height, with the bobbing of steps.
      p.z() = 1.45 + 0.12 * z_.At(time_) + 0.02 * std::sin(2 * M_PI * 1.8 * time_);
    }
    return p;
  }

  // Direction of the camera: along the path, swinging sideways and up and down.
  Vector3d YawPitchRoll() const {
    const bool walk = options_.motion == Motion::kWalk;
    const double yaw = heading_ + 0.7 * yaw_.At(time_) + (walk ? 0.02 : 0.01) * tremble_.At(time_);
    const double pitch = 0.22 * pitch_.At(time_) + (walk ? 0.02 : 0.008) * tremble_.At(time_ + 50);
    const double roll = (walk ? 0.1 : 0.03) * roll_.At(time_) + 0.01 * tremble_.At(time_ + 90);
    return {yaw, pitch, roll};
  }

 private:
  const GeneratedPathOptions& options_;
  Route route_;
  Rng rng_;
  int direction_ = 1;
  double phase_ = 0;
  double time_ = 0;
  double heading_ = 0;
  Wander speed_{0.03, 0.15, &rng_};
  Wander x_{0.02, 0.2, &rng_}, y_{0.02, 0.2, &rng_}, z_{0.03, 0.25, &rng_};
  Wander yaw_{0.04, 0.3, &rng_}, pitch_{0.05, 0.4, &rng_}, roll_{0.1, 0.6, &rng_};
  Wander tremble_{1.5, 5.0, &rng_};
};

// Camera with z forward, x right, y down; while stationary it is level and looks along +x (yaw 0).
Eigen::Quaterniond LevelCamera() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return Eigen::Quaterniond(R);
}

Eigen::Quaterniond Attitude(const Vector3d& yaw_pitch_roll) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(yaw_pitch_roll.x(), Vector3d::UnitZ()) *
                            Eigen::AngleAxisd(yaw_pitch_roll.y(), Vector3d::UnitY()) *
                            Eigen::AngleAxisd(yaw_pitch_roll.z(), Vector3d::UnitX()));
}

// A drone's thrust points along its acceleration minus gravity.
Eigen::Quaterniond Lean(const Vector3d& acceleration) {
  return Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(),
                                            acceleration + Vector3d(0, 0, kGravity));
}

}  // namespace

Trajectory GeneratePath(const GeneratedPathOptions& options) {
  constexpr double kPeriod = 0.02;
  // Accelerations are second differences over this many samples on each side, which models the
  // inertia of the tilting body. As many samples are added at both ends of the path, and dropped
  // again.
  constexpr int kReach = 5;
  const int count = static_cast<int>(options.duration_s / kPeriod) + 1;
  Traveller traveller(options);
  std::vector<Vector3d> positions;
  std::vector<Vector3d> angles;
  for (int i = -kReach; i < count + kReach; ++i) {
    constexpr double kTakeOff = 2.0;
    const double x = options.static_start_s > 0
                         ? std::clamp((i * kPeriod - options.static_start_s) / kTakeOff, 0.0, 1.0)
                         : 1.0;
    traveller.Step(kPeriod, x * x * (3 - 2 * x));
    positions.push_back(traveller.Position());
    angles.push_back(traveller.YawPitchRoll());
  }
  Trajectory trajectory;
  constexpr int64_t kOriginUtime = 1700000000000000;
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<size_t>(i) + kReach;
    Eigen::Quaterniond lean = Eigen::Quaterniond::Identity();
    if (options.motion == Motion::kFlight) {
      const double interval = kReach * kPeriod;
      lean = Lean((positions[at + kReach] - 2 * positions[at] + positions[at - kReach]) /
                  (interval * interval));
    }
    const Eigen::Quaterniond q_ref_cam = lean * Attitude(angles[at]) * LevelCamera();
    trajectory.push_back(
        {kOriginUtime + std::llround(1e6 * kPeriod * i),
         Rigid3((q_ref_cam * options.q_body_cam.conjugate()).normalized(), positions[at])});
  }
  return trajectory;
}

}  // namespace pangea::sim

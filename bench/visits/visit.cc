#include "bench/visits/visit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>

namespace pangea::bench {
namespace {

constexpr double kPixelSigma = 0.3;  // on octave 0, in addition to the recording's noise
constexpr int kFlippedBits = 10;     // of 256
constexpr float kMinInverseDepth = 1e-3F;

class Noise {
 public:
  explicit Noise(uint64_t seed) : random_(seed) {}
  double Normal(double sigma) { return sigma * normal_(random_); }
  uint64_t Bit() { return random_() % kDescriptorBits; }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

void AddNoise(const CameraModel& camera, Noise* noise, Corner* corner) {
  const double sigma = CornerSigma(*corner, kPixelSigma);
  const auto moved = [&](float at, int size) {
    return static_cast<float>(std::clamp(at + noise->Normal(sigma), 0.0, size - 1.0));
  };
  corner->pixel = {moved(corner->pixel.x(), camera.width), moved(corner->pixel.y(), camera.height)};
  for (int i = 0; i < kFlippedBits; ++i) {
    const uint64_t bit = noise->Bit();
    corner->descriptor[bit / 64] ^= uint64_t{1} << (bit % 64);
  }
}

// The accumulated drift of the odometry, in odom: yaw and position; gravity determines roll and
// pitch.
class Walk {
 public:
  Rigid3 Step(const Keyframe& keyframe, const Rigid3& T_odom_previous, Noise* noise) {
    const Eigen::LLT<Matrix6d> L(keyframe.edge->covariance);
    Vector6d white;
    for (double& w : white) {
      w = noise->Normal(1);
    }
    const Vector6d error = L.matrixL() * white;
    const double yaw = (T_odom_previous.q * Eigen::Vector3d(error.tail<3>())).z();
    const Eigen::Quaterniond rotation = YawRotation(yaw);
    // The rotation is about the start of the edge.
    const Eigen::Vector3d shift = T_odom_previous.q * Eigen::Vector3d(error.head<3>()) +
                                  T_odom_previous.t - rotation * T_odom_previous.t;
    drift_ = drift_ * Rigid3(rotation, shift);
    return drift_;
  }

 private:
  Rigid3 drift_;
};

}  // namespace

std::vector<Keyframe> VisitAgain(const std::vector<Keyframe>& keyframes, int64_t opened_utime,
                                 uint64_t visit) {
  Noise noise(visit);
  Walk walk;
  std::vector<Keyframe> again = keyframes;
  for (size_t k = 0; k < again.size(); ++k) {
    const Keyframe& stored = keyframes[k];
    Keyframe& keyframe = again[k];
    keyframe.id.map.opened_utime = opened_utime;
    if (keyframe.edge) {
      const Rigid3 drift = walk.Step(stored, keyframes[stored.edge->from_seq].T_odom_body, &noise);
      keyframe.T_odom_body = drift * stored.T_odom_body;
      keyframe.v_odom_body = drift.q * stored.v_odom_body;
      keyframe.edge->T_from_this =
          again[stored.edge->from_seq].T_odom_body.Inverse() * keyframe.T_odom_body;
    }
    for (Corner& corner : keyframe.corners) {
      AddNoise(keyframe.camera, &noise, &corner);
    }
    for (MapPoint& point : keyframe.points) {
      const double sigma = std::sqrt(static_cast<double>(point.inverse_depth_var));
      point.inverse_depth = std::max(
          kMinInverseDepth, static_cast<float>(point.inverse_depth + noise.Normal(0.5 * sigma)));
    }
  }
  return again;
}

}  // namespace pangea::bench

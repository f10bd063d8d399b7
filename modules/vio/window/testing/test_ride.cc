#include "vio/window/testing/test_ride.h"

namespace pangea::vio {
namespace {

EstimatorOptions Options(const VioTestWorldOptions& world) {
  EstimatorOptions options;
  if (world.unknown_distortion == 0) {
    options.calibration.distortion = 0.0003;
  }
  options.pixel_sigma = VioTestWorldOptions{}.pixel_noise;
  return options;
}

// `only_starts`: a ride ends with its first finished keyframe.
std::deque<Ride> MakeRides(uint64_t count, VioTestWorldOptions options, int frames,
                           bool only_starts = false) {
  std::deque<Ride> rides;
  for (uint64_t seed = 1; seed <= count; ++seed) {
    options.seed = seed;
    options.extrinsics_rotation_sigma = 0.002;
    options.extrinsics_position_sigma = 0.002;
    options.focal_sigma = 0.001;
    options.centre_sigma = 0.001;
    Ride& ride = rides.emplace_back(options);
    for (int i = 0; i < frames && !(only_starts && !ride.finished.empty()); ++i) {
      ride.Advance(1);
    }
    ride.Flush();
  }
  return rides;
}

}  // namespace

Ride::Ride(const VioTestWorldOptions& options)
    : world(options), estimator(Options(options), world.camera(), options.imu_noise) {}

void Ride::Feed(const VioTestWorld::Input& input) {
  last = estimator.AddFrame(input.frame, input.imu);
  world.Drop(last.outlier_landmarks);
  finished.insert(finished.end(), last.finished.begin(), last.finished.end());
  if (last.state == EstimatorState::kTracking) {
    tracked.push_back({input.frame.utime, last, world.TruthAt(input.taken_utime)});
    if (started_s < 0) {
      started_s = 1e-6 * static_cast<double>(input.frame.utime - 1'000'000);
    }
  }
}

void Ride::Advance(int frames) {
  for (int i = 0; i < frames; ++i) {
    Feed(world.Next());
  }
}

void Ride::Flush() {
  const std::vector<FinishedKeyframe> rest = estimator.Flush();
  finished.insert(finished.end(), rest.begin(), rest.end());
}

Rigid3 Ride::T_odom_truth() const {
  const Frame& first = tracked.front();
  const Rigid3 T = first.result.T_odom_body * first.truth.T_odom_body.Inverse();
  const Eigen::Quaterniond q = YawRotation(YawOf(T.q));
  return {q, first.result.T_odom_body.t - q * first.truth.T_odom_body.t};
}

const std::deque<Ride>& TenRides() {
  static const std::deque<Ride> rides = MakeRides(10, {}, 150);
  return rides;
}

std::deque<Ride> ShortRides(uint64_t count, const VioTestWorldOptions& options) {
  return MakeRides(count, options, 60);
}

std::deque<Ride> Starts(uint64_t count, const VioTestWorldOptions& options) {
  return MakeRides(count, options, 60, true);
}

}  // namespace pangea::vio

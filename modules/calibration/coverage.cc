#include "calibration/coverage.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/orientation_curve.h"
#include "core/median.h"
#include "core/rigid3.h"

namespace pangea::calibration {
namespace {

constexpr double kLongestStep_s = 0.25;  // from pair to pair: images may come at only 8 Hz

// Steps are longer than kPairStep_s if images do not come at multiples of it.
double SecondsOf(std::span<const FramePair> pairs) {
  double seconds = kPairStep_s;
  for (size_t i = 1; i < pairs.size(); ++i) {
    const double step_s = pairs[i].a_s - pairs[i - 1].a_s;
    seconds += step_s < kLongestStep_s ? step_s : kPairStep_s;
  }
  return seconds;
}

}  // namespace

double Coverage::RotationShare(int axis) const {
  return std::min(1.0, rotation_rms[axis] * std::sqrt(seconds / kGood_s) / kGoodRotation);
}

double Coverage::Share() const {
  const double rotation = std::min({RotationShare(0), RotationShare(1), RotationShare(2)});
  return std::min({1.0, seconds / kGood_s, rotation});
}

Coverage CoverageOf(std::span<const FramePair> pairs, std::span<const ImuSample> imu,
                    int64_t origin_utime, const Parameters& parameters) {
  Coverage coverage;
  if (pairs.empty()) {
    return coverage;
  }
  const OrientationCurve curve(imu, origin_utime, parameters.gyro_bias);
  Eigen::Vector3d squared = Eigen::Vector3d::Zero();
  std::vector<size_t> counts;
  for (const FramePair& pair : pairs) {
    const double a_s = pair.a_s + parameters.MiddleRowOffset_s();
    const double b_s = pair.b_s + parameters.MiddleRowOffset_s();
    const Eigen::Vector3d rotation =
        LogSo3(curve.At(a_s).conjugate() * curve.At(b_s)) / (b_s - a_s);
    squared += (parameters.camera.T_body_cam.q.conjugate() * rotation).cwiseAbs2();
    counts.push_back(pair.points.size());
  }
  const auto count = static_cast<double>(pairs.size());
  coverage.seconds = SecondsOf(pairs);
  coverage.points = static_cast<double>(Median(std::move(counts)));
  coverage.rotation_rms = (squared / count).cwiseSqrt();
  return coverage;
}

}  // namespace pangea::calibration

#include "calibration/coverage.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/orientation_curve.h"
#include "core/median.h"
#include "core/rigid3.h"

namespace pangea::calibration {

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
  coverage.seconds = kPairStep_s * count;
  coverage.points = static_cast<double>(Median(std::move(counts)));
  coverage.rotation_rms = (squared / count).cwiseSqrt();
  return coverage;
}

}  // namespace pangea::calibration

#include "core/keyframe.h"

#include <utility>

#include "core/median.h"

namespace pangea {

const std::array<double, kNumOctaves> kOctaveScales = [] {
  std::array<double, kNumOctaves> scales{};
  for (int octave = 0; octave < kNumOctaves; ++octave) {
    scales[octave] = std::pow(kOctaveScale, octave);
  }
  return scales;
}();

double UnknownScaleSigma(const std::vector<double>& scale_sigmas) {
  std::vector<double> known = scale_sigmas;
  std::erase(known, 0);
  return known.empty() ? 0 : UnknownScaleSigma(Median(std::move(known)));
}

std::optional<Eigen::Vector3d> PointInCamera(const Keyframe& keyframe, const MapPoint& point) {
  const auto ray = keyframe.camera.Unproject(keyframe.corners[point.corner].pixel.cast<double>());
  if (!ray) {
    return std::nullopt;
  }
  return Eigen::Vector3d(ray->x(), ray->y(), 1.0) / point.inverse_depth;
}

}  // namespace pangea

#include "vio/window/landmarks/landmark_check.h"

#include <algorithm>
#include <cmath>

#include "vio/window/landmarks/landmark_factor.h"

namespace pangea::vio {
namespace {

constexpr double kMaxRayError = 5.0;     // sigmas
constexpr double kMaxLandmarkRms = 2.0;  // sigmas of a ray's coordinate

// 95 % quantile of chi-square (Wilson & Hilferty, 1931).
double ChiSquare95(int degrees_of_freedom) {
  const double k = degrees_of_freedom;
  const double c = 1 - 2 / (9 * k) + 1.6449 * std::sqrt(2 / (9 * k));
  return k * c * c * c;
}

struct LandmarkError {
  double sum = 0;    // of squared errors, in sigmas^2
  double worst = 0;  // largest error of a ray, in sigmas
};
LandmarkError ErrorOf(RowViews& rows, const Landmark& landmark) {
  LandmarkError error;
  const Eigen::Vector3d p_odom = InOdom(rows, landmark.point);
  for (const FrameRay& ray : landmark.rays) {
    const double e = RayError(rows, p_odom, ray);
    error.sum += e * e;
    error.worst = std::max(error.worst, e);
  }
  return error;
}

}  // namespace

bool IsSeenIn(int frame, const Landmark& landmark) {
  return std::any_of(landmark.rays.begin(), landmark.rays.end(),
                     [frame](const FrameRay& ray) { return ray.frame == frame; });
}

bool IsOutlier(RowViews& rows, const Landmark& landmark) {
  const LandmarkError error = ErrorOf(rows, landmark);
  const double rms = std::sqrt(error.sum / (2.0 * static_cast<double>(landmark.rays.size())));
  return !(rms < kMaxLandmarkRms && error.worst < kMaxRayError);
}

bool FitsAsWhole(RowViews& rows, const Landmark& landmark) {
  return ErrorOf(rows, landmark).sum <= ChiSquare95(2 * static_cast<int>(landmark.rays.size()) - 3);
}

}  // namespace pangea::vio

#include "calibration/search.h"

#include <algorithm>
#include <cmath>

#include "calibration/solver.h"

namespace pangea::calibration {
namespace {

double Motion(const FramePair& pair) {
  double squared = 0;
  for (const PointPair& point : pair.points) {
    squared += (point.b - point.a).squaredNorm();
  }
  return squared / static_cast<double>(pair.points.size());
}

}  // namespace

std::vector<FramePair> WithMostMotion(std::span<const FramePair> pairs,
                                      const SearchOptions& options) {
  std::vector<FramePair> most(pairs.begin(), pairs.end());
  std::ranges::stable_sort(most, std::ranges::greater{}, Motion);
  most.resize(std::min(most.size(), static_cast<size_t>(options.max_pairs)));
  for (FramePair& pair : most) {
    Thin(options.max_points, &pair);
  }
  return most;
}

std::vector<Eigen::Quaterniond> AxisAlignedRotations() {
  std::vector<Eigen::Quaterniond> rotations;
  for (int x = 0; x < 6; ++x) {
    for (int y = 0; y < 6; ++y) {
      if (x / 2 == y / 2) {
        continue;
      }
      Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
      R(x / 2, 0) = x % 2 == 0 ? 1 : -1;
      R(y / 2, 1) = y % 2 == 0 ? 1 : -1;
      R.col(2) = R.col(0).cross(R.col(1));
      rotations.emplace_back(R);
    }
  }
  return rotations;
}

double FieldOfView(const CameraModel& camera) {
  const double half_px = 0.5 * std::max(camera.width, camera.height);
  return 2 * (camera.kind == CameraModel::Kind::kEquidistant ? half_px / camera.fx
                                                             : std::atan(half_px / camera.fx));
}

double FocalOf(double field_of_view, const CameraModel& camera) {
  const double half_px = 0.5 * std::max(camera.width, camera.height);
  return camera.kind == CameraModel::Kind::kEquidistant ? half_px / (0.5 * field_of_view)
                                                        : half_px / std::tan(0.5 * field_of_view);
}

std::vector<Hypothesis> Search(std::span<const FramePair> pairs, std::span<const ImuSample> imu,
                               int64_t origin_utime, const CameraModel& camera,
                               std::span<const Eigen::Quaterniond> rotations,
                               std::span<const double> fields_of_view,
                               const SearchOptions& options) {
  size_t num_residuals = 0;
  for (const FramePair& pair : pairs) {
    num_residuals += pair.points.size();
  }
  SolverOptions stiff;
  stiff.velocity_change = options.velocity_change;
  const Solver solver(pairs, imu, origin_utime, stiff);
  std::vector<Hypothesis> hypotheses;
  for (const Eigen::Quaterniond& rotation : rotations) {
    for (const double field_of_view : fields_of_view) {
      Hypothesis best{.parameters = {}, .cost = 1e300};
      for (double offset = -options.max_offset_s; offset <= options.max_offset_s + 1e-9;
           offset += options.offset_step_s) {
        Parameters trial;
        trial.camera = camera;
        trial.camera.fx = trial.camera.fy = FocalOf(field_of_view, camera);
        trial.camera.T_body_cam.q = rotation;
        trial.camera.time_offset_s = offset - 0.5 * camera.readout_s;
        const double cost = solver.Cost(trial, options.sigma_px) /
                            static_cast<double>(std::max<size_t>(1, num_residuals));
        if (cost < best.cost) {
          best = {trial, cost};
        }
      }
      hypotheses.push_back(best);
    }
  }
  std::ranges::stable_sort(hypotheses, {}, &Hypothesis::cost);
  return hypotheses;
}

}  // namespace pangea::calibration

#include "calibration/search.h"

#include <algorithm>

#include "calibration/solver.h"

namespace pangea::calibration {
namespace {

constexpr double kOffsetStep_s = 0.015;
constexpr size_t kMaxPairs = 50;
constexpr int kMaxPointsOfPair = 25;  // per pair
constexpr double kGridSigma_px = 3;   // residual error due to the grid

double Motion(const FramePair& pair) {
  double squared = 0;
  for (const PointPair& point : pair.points) {
    squared += (point.b - point.a).squaredNorm();
  }
  return squared / static_cast<double>(pair.points.size());
}

}  // namespace

void SortByCost(std::vector<Hypothesis>* hypotheses) {
  std::stable_sort(hypotheses->begin(), hypotheses->end(),
                   [](const Hypothesis& a, const Hypothesis& b) { return a.cost < b.cost; });
}

std::vector<FramePair> WithMostMotion(std::span<const FramePair> pairs) {
  std::vector<FramePair> most(pairs.begin(), pairs.end());
  std::stable_sort(most.begin(), most.end(),
                   [](const FramePair& a, const FramePair& b) { return Motion(a) > Motion(b); });
  most.resize(std::min(most.size(), kMaxPairs));
  for (FramePair& pair : most) {
    Thin(kMaxPointsOfPair, &pair);
  }
  return most;
}

std::vector<Hypothesis> Search(std::span<const FramePair> pairs, std::span<const ImuSample> imu,
                               int64_t origin_utime, const CameraModel& camera,
                               std::span<const Eigen::Quaterniond> rotations,
                               std::span<const double> fields_of_view) {
  size_t num_residuals = 0;
  for (const FramePair& pair : pairs) {
    num_residuals += pair.points.size();
  }
  const Solver solver(pairs, imu, origin_utime, kSearchVelocityChange);
  std::vector<Hypothesis> hypotheses;
  for (const Eigen::Quaterniond& rotation : rotations) {
    for (const double field_of_view : fields_of_view) {
      Hypothesis best{.parameters = {}, .cost = 1e300};
      for (double offset = -kMaxOffset_s; offset <= kMaxOffset_s + 1e-9; offset += kOffsetStep_s) {
        Parameters trial;
        trial.camera = camera;
        trial.camera.fx = trial.camera.fy = FocalOf(field_of_view, camera);
        trial.camera.T_body_cam.q = rotation;
        trial.camera.time_offset_s = offset - 0.5 * camera.readout_s;
        const double cost = solver.Cost(trial, kGridSigma_px) /
                            static_cast<double>(std::max<size_t>(1, num_residuals));
        if (cost < best.cost) {
          best = {trial, cost};
        }
      }
      hypotheses.push_back(best);
    }
  }
  SortByCost(&hypotheses);
  return hypotheses;
}

}  // namespace pangea::calibration

#include "calibration/search.h"

#include <fmt/format.h>

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

Eigen::Quaterniond NearestAxisAligned(const Eigen::Quaterniond& q_body_cam) {
  const std::vector<Eigen::Quaterniond> rotations = AxisAlignedRotations();
  return *std::min_element(rotations.begin(), rotations.end(),
                           [&](const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
                             return a.angularDistance(q_body_cam) < b.angularDistance(q_body_cam);
                           });
}

std::string AxesOf(const Eigen::Quaterniond& q_body_cam) {
  const Eigen::Matrix3d R = NearestAxisAligned(q_body_cam).toRotationMatrix();
  std::string axes;
  for (int col = 0; col < 3; ++col) {
    Eigen::Index row = 0;
    R.col(col).cwiseAbs().maxCoeff(&row);
    axes += fmt::format("{}{}{}", col > 0 ? "," : "", R(row, col) < 0 ? "-" : "", "xyz"[row]);
  }
  return axes;
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

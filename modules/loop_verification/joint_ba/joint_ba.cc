#include "loop_verification/joint_ba/joint_ba.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/median.h"
#include "loop_verification/joint_ba/joint_problem.h"

namespace pangea {
namespace {

// Median distance of the inliers' points from the newest keyframe of their window.
double MedianDistance(const WindowPair& windows, const std::vector<PointMatch>& matches,
                      const std::vector<bool>& inlier) {
  std::vector<double> distances;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (inlier[i]) {
      const Window& holder = windows.Holder(matches[i].direction);
      distances.push_back(holder.landmarks[matches[i].landmark].p_w.norm());
    }
  }
  return Median(std::move(distances));
}

// Sigmas of the error that all corners of a view share (JointBaOptions::systematic_px).
Vector6d SystematicSigmas(const WindowPair& windows, const std::vector<PointMatch>& matches,
                          const std::vector<bool>& inlier, double systematic_px) {
  const double rotation =
      systematic_px * windows.c.keyframe(windows.c.newest()).camera.PixelAngle();
  const double step = rotation * MedianDistance(windows, matches, inlier);
  Vector6d sigmas;
  sigmas << Eigen::Vector3d::Constant(step), Eigen::Vector3d::Constant(rotation);
  return sigmas;
}

// Rotates a covariance from the window's axes to Km's; the origin is Km's already.
Matrix6d InAxesOfKm(const Matrix6d& covariance, const Eigen::Matrix3d& R_Km_w, double scale,
                    const Vector6d& systematic_sigmas) {
  Matrix6d rotation = Matrix6d::Zero();
  rotation.topLeftCorner<3, 3>() = R_Km_w;
  rotation.bottomRightCorner<3, 3>() = R_Km_w;
  Matrix6d rotated = scale * rotation * covariance * rotation.transpose();
  rotated.diagonal() += systematic_sigmas.cwiseAbs2();
  return rotated;
}

}  // namespace

std::optional<JointBaResult> SolveJointBa(const WindowPair& windows,
                                          const std::vector<PointMatch>& matches,
                                          const Rigid3& T_m_c, const JointBaOptions& options,
                                          JointBaCovariances covariances) {
  JointProblem problem(windows, T_m_c, options);
  JointBaResult result;
  result.inlier.assign(matches.size(), true);
  double chi2_sum = 0;
  // The first round finds the outliers, the second one gives the estimate.
  constexpr double kLossScale = 2.0;  // sigmas
  for (const auto loss : {RobustLoss::Kind::kCauchy, RobustLoss::Kind::kHuber}) {
    if (!problem.Solve(matches, result.inlier, {.kind = loss, .scale = kLossScale})) {
      return std::nullopt;
    }
    problem.Classify(&result.inlier, &chi2_sum);
  }
  result.num_inlier_observations = static_cast<int>(std::ranges::count(result.inlier, true));
  const auto marginals = problem.MarginalsOfNewestC(matches, result.inlier, covariances);
  if (!marginals || result.num_inlier_observations == 0) {
    return std::nullopt;
  }
  // chi2 is in sigmas of each corner's own octave; an observation has two dimensions.
  const double variance = chi2_sum / (2.0 * result.num_inlier_observations);
  result.rms_px = options.pixel_sigma * std::sqrt(2.0 * variance);

  const Rigid3 T_w_Km = problem.NewestPose(kSideM);
  const Rigid3 T_w_Kc = problem.NewestPose(kSideC);
  result.T_m_c = T_w_Kc * windows.c.T_w_body.back().Inverse();
  result.T_Km_Kc = T_w_Km.Inverse() * T_w_Kc;
  const Vector6d systematic =
      SystematicSigmas(windows, matches, result.inlier, options.systematic_px);
  const auto in_Km = [&](const Matrix6d& covariance) {
    // Scale up if the residuals are larger than expected.
    return InAxesOfKm(covariance, T_w_Km.R().transpose(), std::max(1.0, variance), systematic);
  };
  result.covariance = in_Km(marginals->all);
  if (marginals->without_one) {
    result.covariance_without_one = in_Km(*marginals->without_one);
  }
  if (marginals->of_sure) {
    result.covariance_of_sure = in_Km(*marginals->of_sure);
  }
  return result;
}

}  // namespace pangea

#include "calibration/solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/median.h"

namespace pangea::calibration {
namespace {

constexpr double kMadToSigma = 1.4826;
constexpr double kLeastSigma_px = 0.02, kLeastMedian_px = 0.2;
constexpr double kDirectionStep = 1e-5;  // of its numeric derivative
// Information about a direction of translation that nothing tells.
constexpr double kDirectionDamping = 1e-3;
constexpr double kConverged = 0.01;  // of a step, in standard deviations
constexpr double kInlierSigmas = 3;

// Step of the numeric derivative of each row: small against what a residual is linear in.
Tangent DerivativeSteps() {
  Tangent h = Tangent::Constant(1e-5);
  h.segment<2>(kCentre).setConstant(1e-2);
  return h;
}

// Two directions across `v`.
Eigen::Matrix<double, 3, 2> Across(const Eigen::Vector3d& v) {
  Eigen::Matrix<double, 3, 2> across;
  across.col(0) = v.unitOrthogonal();
  across.col(1) = v.cross(across.col(0));
  return across;
}

// All points alike, then without the outliers.
Eigen::Vector3d RobustDirection(const PairGeometry& geometry) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(geometry.size());
  const Eigen::Vector3d first = geometry.Direction(weights, Eigen::Vector3d::Zero());
  const Eigen::VectorXd absolute = geometry.Residuals(first).cwiseAbs();
  const double middle = Median(std::vector<double>(absolute.begin(), absolute.end()));
  weights = (1 + (absolute / (2 * std::max(kLeastMedian_px, middle))).array().square()).inverse();
  return geometry.Direction(weights, first);
}

double RobustSigma(const std::vector<Eigen::VectorXd>& residuals) {
  std::vector<double> absolute;
  for (const Eigen::VectorXd& r : residuals) {
    for (const double value : r) {
      absolute.push_back(std::abs(value));
    }
  }
  return absolute.empty() ? 1 : std::max(kLeastSigma_px, kMadToSigma * Median(absolute));
}

Information PriorInformation(const Prior& prior) {
  Information information = Information::Zero();
  for (int i = 0; i < kSize; ++i) {
    information(i, i) = prior.sigma[i] > 0 ? 1 / (prior.sigma[i] * prior.sigma[i]) : 0;
  }
  return information;
}

}  // namespace

struct Solver::PairTerms {
  Eigen::Vector3d direction;
  Eigen::VectorXd residuals;
};

struct Solver::Linearised {
  Information hessian = Information::Zero();  // of the data
  Tangent gradient = Tangent::Zero();         // of the data
  std::map<int64_t, Tangent> blocks;          // the gradient of each block of time
  Information prior = Information::Zero();
  Tangent prior_gradient = Tangent::Zero();
  double sigma_px = 1;
  double inlier_share = 0;
  double cost = 0;
};

Solver::Solver(std::span<const FramePair> pairs, std::span<const ImuSample> imu,
               int64_t origin_utime, const SolverOptions& options)
    : pairs_(pairs), imu_(imu), origin_utime_(origin_utime), options_(options) {}

std::vector<PairRays> Solver::Rays(const CameraModel& camera) const {
  std::vector<PairRays> rays;
  for (const FramePair& pair : pairs_) {
    rays.push_back(Unprojected(pair, camera));
  }
  return rays;
}

std::vector<PairGeometry> Solver::Geometries(const Parameters& parameters,
                                             const std::vector<PairRays>& rays) const {
  const OrientationCurve curve(imu_, origin_utime_, parameters.gyro_bias);
  std::vector<PairGeometry> geometries;
  for (size_t p = 0; p < pairs_.size(); ++p) {
    geometries.emplace_back(pairs_[p], rays[p], parameters, curve);
  }
  return geometries;
}

std::vector<Eigen::VectorXd> Solver::Residuals(const Parameters& parameters) const {
  std::vector<Eigen::VectorXd> residuals;
  for (const PairGeometry& geometry : Geometries(parameters, Rays(parameters.camera))) {
    residuals.push_back(geometry.Residuals(RobustDirection(geometry)));
  }
  return residuals;
}

double Solver::RobustCost(const std::vector<Eigen::VectorXd>& residuals, double sigma_px) const {
  const double c = options_.robust_at;
  double cost = 0;
  for (const Eigen::VectorXd& r : residuals) {
    cost += 0.5 * c * c * (1 + (r / (c * sigma_px)).array().square()).log().sum();
  }
  return cost;
}

double Solver::Cost(const Parameters& parameters, double sigma_px) const {
  return RobustCost(Residuals(parameters), sigma_px);
}

double Solver::TotalCost(const Parameters& parameters, const Prior& prior, double sigma_px) const {
  const Tangent off = parameters.Minus(prior.mean);
  return RobustCost(Residuals(parameters), sigma_px) + 0.5 * off.dot(PriorInformation(prior) * off);
}

std::vector<Eigen::MatrixXd> Solver::Jacobians(const Parameters& parameters, const Prior& prior,
                                               const std::vector<PairRays>& rays,
                                               const std::vector<PairTerms>& terms) const {
  std::vector<Eigen::MatrixXd> jacobians;
  for (const PairTerms& term : terms) {
    jacobians.push_back(Eigen::MatrixXd::Zero(term.residuals.size(), kSize));
  }
  const Tangent h = DerivativeSteps();
  for (int k = 0; k < kSize; ++k) {
    if (prior.sigma[k] <= 0) {
      continue;
    }
    const Parameters moved = parameters.Plus(h[k] * Tangent::Unit(k));
    const bool lens = k >= kLogFocal && k <= kDistortion;
    const std::vector<PairGeometry> geometries =
        Geometries(moved, lens ? Rays(moved.camera) : rays);
    for (size_t p = 0; p < terms.size(); ++p) {
      jacobians[p].col(k) =
          (geometries[p].Residuals(terms[p].direction) - terms[p].residuals) / h[k];
    }
  }
  return jacobians;
}

void Solver::EliminateDirection(const PairGeometry& geometry, const PairTerms& terms,
                                const Eigen::VectorXd& root_weights, Eigen::MatrixXd* wJ) {
  const Eigen::Matrix<double, 3, 2> across = Across(terms.direction);
  Eigen::MatrixXd wB(terms.residuals.size(), 2);
  for (int k = 0; k < 2; ++k) {
    const Eigen::Vector3d moved = (terms.direction + kDirectionStep * across.col(k)).normalized();
    wB.col(k) = (geometry.Residuals(moved) - terms.residuals) / kDirectionStep;
  }
  wB = root_weights.asDiagonal() * wB;
  Eigen::Matrix2d normal = wB.transpose() * wB;
  normal.diagonal().array() += kDirectionDamping;
  *wJ -= wB * normal.ldlt().solve(wB.transpose() * *wJ);
}

Solver::Linearised Solver::Linearise(const Parameters& parameters, const Prior& prior) const {
  const std::vector<PairRays> rays = Rays(parameters.camera);
  const std::vector<PairGeometry> geometries = Geometries(parameters, rays);
  std::vector<PairTerms> terms;
  std::vector<Eigen::VectorXd> residuals;
  for (const PairGeometry& geometry : geometries) {
    const Eigen::Vector3d direction = RobustDirection(geometry);
    residuals.push_back(geometry.Residuals(direction));
    terms.push_back({direction, residuals.back()});
  }
  const std::vector<Eigen::MatrixXd> jacobians = Jacobians(parameters, prior, rays, terms);
  Linearised at;
  at.sigma_px = RobustSigma(residuals);
  double inliers = 0, all = 0;
  for (size_t p = 0; p < terms.size(); ++p) {
    const Eigen::VectorXd& r = residuals[p];
    const Eigen::VectorXd root_weights =
        (1 + (r / (options_.robust_at * at.sigma_px)).array().square()).rsqrt() / at.sigma_px;
    Eigen::MatrixXd wJ = root_weights.asDiagonal() * jacobians[p];
    EliminateDirection(geometries[p], terms[p], root_weights, &wJ);
    const Tangent gradient = wJ.transpose() * root_weights.cwiseProduct(r);
    at.hessian += wJ.transpose() * wJ;
    at.gradient += gradient;
    const auto block = static_cast<int64_t>(std::floor(pairs_[p].a_s / options_.block_s));
    at.blocks.try_emplace(block, Tangent::Zero()).first->second += gradient;
    inliers += static_cast<double>((r.array().abs() < kInlierSigmas * at.sigma_px).count());
    all += static_cast<double>(r.size());
  }
  at.inlier_share = all > 0 ? inliers / all : 0;
  at.prior = PriorInformation(prior);
  at.prior_gradient = at.prior * parameters.Minus(prior.mean);
  at.cost = RobustCost(residuals, at.sigma_px) +
            0.5 * parameters.Minus(prior.mean).dot(at.prior_gradient);
  return at;
}

bool Solver::Plausible(const CameraModel& camera) const {
  const double half_px = 0.5 * std::max(camera.width, camera.height);
  const double half = camera.kind == CameraModel::Kind::kEquidistant
                          ? half_px / camera.fx
                          : std::atan(half_px / camera.fx);
  return camera.fx > 0 && 2 * half > options_.min_field_of_view &&
         2 * half < options_.max_field_of_view &&
         std::abs(camera.distortion[0]) < options_.max_distortion;
}

Information Solver::Covariance(const Linearised& at) const {
  Information h = at.hessian + at.prior;
  for (int i = 0; i < kSize; ++i) {
    h(i, i) += h(i, i) == 0 ? 1e12 : 0;  // a row that is held
  }
  const Information usual = h.ldlt().solve(Information::Identity());
  const Tangent mean = at.gradient / static_cast<double>(std::max<size_t>(1, at.blocks.size()));
  Information spread = Information::Zero();
  for (const auto& [block, gradient] : at.blocks) {
    spread += (gradient - mean) * (gradient - mean).transpose();
  }
  const auto n = static_cast<double>(at.blocks.size());
  spread *= n / std::max(1.0, n - 1);
  Information grouped = usual * (spread + at.prior) * usual;
  // Rows that the blocks call surer than independent residuals would be: by chance.
  for (int i = 0; i < kSize; ++i) {
    const double scale = std::sqrt(std::max(1.0, usual(i, i) / std::max(1e-30, grouped(i, i))));
    grouped.row(i) *= scale;
    grouped.col(i) *= scale;
  }
  return grouped;
}

Solution Solver::Solve(const Parameters& start, const Prior& prior) const {
  Solution solution;
  solution.parameters = start;
  Linearised at = Linearise(start, prior);
  double damping = 1e-3;
  for (; solution.iterations < options_.max_iterations; ++solution.iterations) {
    Information h = at.hessian + at.prior;
    for (int i = 0; i < kSize; ++i) {
      h(i, i) += damping * h(i, i) + (prior.sigma[i] > 0 ? 0 : 1e12);
    }
    const Tangent step = -h.ldlt().solve(at.gradient + at.prior_gradient);
    const Parameters next = solution.parameters.Plus(step);
    if (Plausible(next.camera) && TotalCost(next, prior, at.sigma_px) < at.cost) {
      solution.parameters = next;
      at = Linearise(next, prior);
      damping = std::max(1e-6, 0.1 * damping);
    } else {
      damping *= 10;
      if (damping > 1e6) {
        break;
      }
    }
    if (std::sqrt(step.dot((at.hessian + at.prior) * step)) < kConverged) {
      break;
    }
  }
  solution.covariance = Covariance(at);
  solution.sigma_px = at.sigma_px;
  solution.inlier_share = at.inlier_share;
  solution.cost = Cost(solution.parameters, 1);
  return solution;
}

}  // namespace pangea::calibration

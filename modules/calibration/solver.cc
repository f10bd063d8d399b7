#include "calibration/solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/median.h"

namespace pangea::calibration {
namespace {

constexpr double kMadToSigma = 1.4826;
constexpr double kLeastSigma_px = 0.02, kLeastMedian_px = 0.2;
constexpr double kTranslationStep = 1e-5;  // of its numeric derivative
// Information about a direction of translation that nothing tells.
constexpr double kDirectionDamping = 1e-3;
constexpr double kConverged = 0.01;  // of a step, in standard deviations
constexpr double kInlierSigmas = 3;
constexpr double kRobustAt = 2.4;  // of the Cauchy loss, in standard deviations
constexpr int kMaxIterations = 25;
constexpr int kLongBlocks = 8;  // of the whole recording: for what changes slowly, as exposure does
// Lenses beyond these are not sought: epipolar residuals vanish as the focal length does.
constexpr double kMinFieldOfView = 0.6, kMaxFieldOfView = 2.4;  // rad, of the wider side
constexpr double kMaxDistortion = 0.6;
constexpr double kMaxDistortionEquidistant = 0.15;  // a lens that is far from equidistant is none

// Step of the numeric derivative of each row: small against what a residual is linear in.
Tangent DerivativeSteps() {
  Tangent h = Tangent::Constant(1e-5);
  h.segment<2>(kCentre).setConstant(1e-2);
  return h;
}

// Two directions across a pair's translation, and its changes of velocity.
Eigen::Matrix<double, 9, 8> Steps(const Translation& translation) {
  Eigen::Matrix<double, 9, 8> steps = Eigen::Matrix<double, 9, 8>::Zero();
  const Eigen::Vector3d d = translation.head<3>();
  steps.col(0).head<3>() = d.unitOrthogonal();
  steps.col(1).head<3>() = d.cross(d.unitOrthogonal());
  steps.bottomRightCorner<6, 6>().setIdentity();
  return steps;
}

// All points alike, then without the outliers.
Translation RobustTranslation(const PairGeometry& geometry) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(geometry.size());
  const Translation first = geometry.BestTranslation(weights, Translation::Zero());
  const Eigen::VectorXd absolute = geometry.Residuals(first).cwiseAbs();
  const double middle = Median(std::vector<double>(absolute.begin(), absolute.end()));
  weights = (1 + (absolute / (2 * std::max(kLeastMedian_px, middle))).array().square()).inverse();
  return geometry.BestTranslation(weights, first);
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
  Translation translation;
  Eigen::VectorXd residuals;
};

struct Solver::Linearised {
  Information hessian = Information::Zero();  // of the data
  Tangent gradient = Tangent::Zero();         // of the data
  std::vector<Tangent> gradients;             // of each pair
  Information prior = Information::Zero();
  Tangent prior_gradient = Tangent::Zero();
  double sigma_px = 1;
  double inlier_share = 0;
  double cost = 0;
};

Solver::Solver(std::span<const FramePair> pairs, std::span<const ImuSample> imu,
               int64_t origin_utime, double velocity_change)
    : pairs_(pairs), imu_(imu), origin_utime_(origin_utime), velocity_change_(velocity_change) {}

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
    geometries.emplace_back(pairs_[p], rays[p], parameters, curve, velocity_change_);
  }
  return geometries;
}

double Solver::RobustCost(const Eigen::VectorXd& residuals, double sigma_px) const {
  const double c = kRobustAt;
  return 0.5 * c * c * (1 + (residuals / (c * sigma_px)).array().square()).log().sum();
}

std::vector<double> Solver::Costs(const Parameters& parameters, double sigma_px) const {
  std::vector<double> costs;
  for (const PairGeometry& geometry : Geometries(parameters, Rays(parameters.camera))) {
    const Translation translation = RobustTranslation(geometry);
    costs.push_back(RobustCost(geometry.Residuals(translation), sigma_px) +
                    geometry.ChangeCost(translation));
  }
  return costs;
}

double Solver::Cost(const Parameters& parameters, double sigma_px) const {
  const std::vector<double> costs = Costs(parameters, sigma_px);
  return std::accumulate(costs.begin(), costs.end(), 0.0);
}

double Solver::TotalCost(const Parameters& parameters, const Prior& prior, double sigma_px) const {
  const Tangent off = parameters.Minus(prior.mean);
  return Cost(parameters, sigma_px) + 0.5 * off.dot(PriorInformation(prior) * off);
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
    const bool lens = k >= kLogFocal && k < kReadout;
    const std::vector<PairGeometry> geometries =
        Geometries(moved, lens ? Rays(moved.camera) : rays);
    for (size_t p = 0; p < terms.size(); ++p) {
      jacobians[p].col(k) =
          (geometries[p].Residuals(terms[p].translation) - terms[p].residuals) / h[k];
    }
  }
  return jacobians;
}

void Solver::AddPair(const PairGeometry& geometry, const PairTerms& terms,
                     const Eigen::MatrixXd& jacobian, Linearised* at) const {
  const Eigen::VectorXd& r = terms.residuals;
  const Eigen::VectorXd root_weights =
      (1 + (r / (kRobustAt * at->sigma_px)).array().square()).rsqrt() / at->sigma_px;
  const Eigen::Matrix<double, 9, 8> steps = Steps(terms.translation);
  Eigen::MatrixXd B(r.size(), 8);
  for (int k = 0; k < 8; ++k) {
    const Translation moved = terms.translation + kTranslationStep * steps.col(k);
    B.col(k) = (geometry.Residuals(moved) - r) / kTranslationStep;
  }
  const Eigen::MatrixXd wB = root_weights.asDiagonal() * B;
  const Eigen::MatrixXd wJ = root_weights.asDiagonal() * jacobian;
  const Eigen::VectorXd wr = root_weights.cwiseProduct(r);
  using Own = Eigen::Matrix<double, 8, 1>;
  Own prior = Own::Constant(kDirectionDamping);
  prior.tail<6>().setConstant(std::pow(geometry.ChangeSigma(), -2));
  Own own_gradient = wB.transpose() * wr;
  own_gradient.tail<6>() += prior[7] * terms.translation.tail<6>();
  Eigen::Matrix<double, 8, 8> own = wB.transpose() * wB;
  own.diagonal() += prior;
  const Eigen::MatrixXd cross = wB.transpose() * wJ;
  const Eigen::LDLT<Eigen::Matrix<double, 8, 8>> factor(own);
  at->gradients.push_back(wJ.transpose() * wr - cross.transpose() * factor.solve(own_gradient));
  at->gradient += at->gradients.back();
  at->hessian += wJ.transpose() * wJ - cross.transpose() * factor.solve(cross);
}

Solver::Linearised Solver::Linearise(const Parameters& parameters, const Prior& prior) const {
  const std::vector<PairRays> rays = Rays(parameters.camera);
  const std::vector<PairGeometry> geometries = Geometries(parameters, rays);
  std::vector<PairTerms> terms;
  std::vector<double> absolute;
  for (const PairGeometry& geometry : geometries) {
    const Translation translation = RobustTranslation(geometry);
    terms.push_back({translation, geometry.Residuals(translation)});
    for (const double r : terms.back().residuals) {
      absolute.push_back(std::abs(r));
    }
  }
  Linearised at;
  at.sigma_px = std::max(kLeastSigma_px, kMadToSigma * Median(absolute));
  const auto inliers = std::count_if(absolute.begin(), absolute.end(),
                                     [&at](double r) { return r < kInlierSigmas * at.sigma_px; });
  at.inlier_share = static_cast<double>(inliers) / static_cast<double>(absolute.size());
  const std::vector<Eigen::MatrixXd> jacobians = Jacobians(parameters, prior, rays, terms);
  for (size_t p = 0; p < terms.size(); ++p) {
    AddPair(geometries[p], terms[p], jacobians[p], &at);
  }
  at.prior = PriorInformation(prior);
  at.prior_gradient = at.prior * parameters.Minus(prior.mean);
  at.cost = TotalCost(parameters, prior, at.sigma_px);
  return at;
}

bool Solver::Plausible(const CameraModel& camera) const {
  const bool equidistant = camera.kind == CameraModel::Kind::kEquidistant;
  const double most = equidistant ? kMaxDistortionEquidistant : kMaxDistortion;
  const double field = FieldOfView(camera);
  return camera.fx > 0 && field > kMinFieldOfView && field < kMaxFieldOfView &&
         camera.distortion.cwiseAbs().maxCoeff() < most;
}

// Of the sum of all pairs' gradients, from how those of blocks of time scatter.
Information Solver::Scatter(const Linearised& at, double block_s) const {
  std::map<int64_t, Tangent> blocks;
  for (size_t p = 0; p < pairs_.size(); ++p) {
    const auto block = static_cast<int64_t>(std::floor(pairs_[p].a_s / block_s));
    blocks.try_emplace(block, Tangent::Zero()).first->second += at.gradients[p];
  }
  const auto n = static_cast<double>(blocks.size());
  const Tangent mean = at.gradient / n;
  Information scatter = Information::Zero();
  for (const auto& [block, gradient] : blocks) {
    scatter += (gradient - mean) * (gradient - mean).transpose();
  }
  return n / std::max(1.0, n - 1) * scatter;
}

Information Solver::Covariance(const Linearised& at) const {
  Information h = at.hessian + at.prior;
  for (int i = 0; i < kSize; ++i) {
    h(i, i) += h(i, i) == 0 ? 1e12 : 0;  // a row that is held
  }
  const Information usual = h.ldlt().solve(Information::Identity());
  const double seconds = pairs_.back().b_s - pairs_.front().a_s;
  Information covariance = usual * (Scatter(at, kBlock_s) + at.prior) * usual;
  const Information slow = usual * (Scatter(at, seconds / kLongBlocks) + at.prior) * usual;
  // The largest of the three for each row: blocks may agree by chance.
  for (int i = 0; i < kSize; ++i) {
    const double largest = std::max({usual(i, i), covariance(i, i), slow(i, i)});
    const double scale = std::sqrt(largest / std::max(1e-30, covariance(i, i)));
    covariance.row(i) *= scale;
    covariance.col(i) *= scale;
  }
  return covariance;
}

Solution Solver::Solve(const Parameters& start, const Prior& prior) const {
  Solution solution;
  solution.parameters = start;
  Linearised at = Linearise(start, prior);
  double damping = 1e-3;
  for (; solution.iterations < kMaxIterations; ++solution.iterations) {
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

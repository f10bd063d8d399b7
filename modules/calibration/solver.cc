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
constexpr double kMinSigma_px = 0.02, kMinMedian_px = 0.2;
constexpr double kTranslationStep = 1e-5;  // step of the numeric derivative
// Information added for an undetermined direction of translation.
constexpr double kDirectionDamping = 1e-3;
constexpr double kInlierSigmas = 3;
constexpr double kRobustAt = 2.4;  // scale of the Cauchy loss, in standard deviations
constexpr int kMaxIterations = 25;
constexpr double kMaxDamping = 1e6;
constexpr double kMinCurvature =
    0.2;                        // of the robust loss, relative to its weights: if most are outliers
constexpr int kLongBlocks = 8;  // in the whole recording: for slow changes, such as the exposure
// Limits of the search: epipolar residuals vanish as the focal length goes to zero.
constexpr double kMinFieldOfView = 0.6, kMaxFieldOfView = 2.4;  // rad, of the wider side
constexpr double kMaxDistortion = 0.6;
constexpr double kMaxDistortionEquidistant = 0.15;  // limit for the equidistant model

// Steps of the numeric derivatives: small enough for residuals to be linear.
Tangent DerivativeSteps() {
  Tangent h = Tangent::Constant(1e-5);
  h.segment<2>(kCentre).setConstant(1e-2);
  h[kIntervalShare] = 1e-3;
  return h;
}

// Tangent of a pair's translation: two directions perpendicular to d, and the changes of velocity
// a, b.
Eigen::Matrix<double, 9, 8> Steps(const Translation& translation) {
  Eigen::Matrix<double, 9, 8> steps = Eigen::Matrix<double, 9, 8>::Zero();
  const Eigen::Vector3d d = translation.head<3>();
  steps.col(0).head<3>() = d.unitOrthogonal();
  steps.col(1).head<3>() = d.cross(d.unitOrthogonal());
  steps.bottomRightCorner<6, 6>().setIdentity();
  return steps;
}

// First with equal weights, then with robust ones.
Translation RobustTranslation(const PairGeometry& geometry) {
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(geometry.size());
  const Translation first = geometry.BestTranslation(weights, Translation::Zero());
  const Eigen::VectorXd absolute = geometry.Residuals(first).cwiseAbs();
  const double middle = Median(std::vector<double>(absolute.begin(), absolute.end()));
  weights = (1 + (absolute / (2 * std::max(kMinMedian_px, middle))).array().square()).inverse();
  return geometry.BestTranslation(weights, first);
}

Information PriorInformation(const Prior& prior) {
  Information information = Information::Zero();
  for (int i = 0; i < kSize; ++i) {
    information(i, i) = prior.sigma[i] > 0 ? 1 / (prior.sigma[i] * prior.sigma[i]) : 0;
  }
  return information;
}

// Makes rows without information invertible; they do not move.
Information WithHeldRows(Information information) {
  for (int i = 0; i < kSize; ++i) {
    information(i, i) += information(i, i) == 0 ? 1e12 : 0;
  }
  return information;
}

}  // namespace

struct Solver::PairResiduals {
  Translation translation;
  Eigen::VectorXd residuals;
};

// A pair's part of the normal equations; `own` rows belong to its translation (Steps).
struct Solver::PairTerms {
  Eigen::Matrix<double, 8, 8> own;
  Eigen::Matrix<double, 8, kSize> cross;
  Information hessian;
  Own own_gradient;
  Tangent gradient;

  // Factor of the translation's block; `damping`: relative to the diagonal.
  Eigen::LDLT<Eigen::Matrix<double, 8, 8>> OwnFactor(double damping) const {
    Eigen::Matrix<double, 8, 8> damped = own;
    damped.diagonal() *= 1 + damping;
    return damped.ldlt();
  }
};

struct Solver::Linearised {
  std::vector<PairTerms> pairs;
  Information prior = Information::Zero();
  Tangent prior_gradient = Tangent::Zero();
  double sigma_px = 1;
  double inlier_share = 0;
  double cost = 0;
  // Sums over residuals of the robust loss's weight, squared derivative and second derivative; in
  // units of standard deviations.
  double weights = 0, squared_slopes = 0, curvatures = 0;
};

// The normal equations of the parameters alone, each pair's translation eliminated.
struct Solver::Reduced {
  Information hessian = Information::Zero();  // of the data
  Tangent gradient = Tangent::Zero();         // of the data
  std::vector<Tangent> gradients;             // of each pair

  Reduced(const Linearised& at, double damping) {
    for (const PairTerms& pair : at.pairs) {
      const auto factor = pair.OwnFactor(damping);
      gradients.push_back(pair.gradient - pair.cross.transpose() * factor.solve(pair.own_gradient));
      gradient += gradients.back();
      hessian += pair.hessian - pair.cross.transpose() * factor.solve(pair.cross);
    }
  }
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
    costs.push_back(CostOf(geometry, translation, sigma_px));
  }
  return costs;
}

double Solver::Cost(const Parameters& parameters, double sigma_px) const {
  const std::vector<double> costs = Costs(parameters, sigma_px);
  return std::accumulate(costs.begin(), costs.end(), 0.0);
}

double Solver::CostOf(const PairGeometry& geometry, const Translation& translation,
                      double sigma_px) const {
  return RobustCost(geometry.Residuals(translation), sigma_px) + geometry.ChangeCost(translation);
}

double Solver::PriorCost(const Parameters& parameters, const Prior& prior) const {
  const Tangent off = parameters.Minus(prior.mean);
  return 0.5 * off.dot(PriorInformation(prior) * off);
}

Solver::State Solver::Begin(const Parameters& parameters) const {
  State state{parameters, {}, 0};
  for (const PairGeometry& geometry : Geometries(parameters, Rays(parameters.camera))) {
    state.translations.push_back(RobustTranslation(geometry));
  }
  return state;
}

Solver::State Solver::Moved(const State& state, const Linearised& at, const Prior& prior,
                            const Tangent& step, double damping) const {
  State next{state.parameters.Plus(step), {}, 0};
  next.cost = PriorCost(next.parameters, prior);
  const std::vector<PairGeometry> geometries =
      Geometries(next.parameters, Rays(next.parameters.camera));
  for (size_t p = 0; p < pairs_.size(); ++p) {
    const PairTerms& pair = at.pairs[p];
    const Own own = -pair.OwnFactor(damping).solve(pair.own_gradient + pair.cross * step);
    Translation moved = state.translations[p] + Steps(state.translations[p]) * own;
    moved /= moved.head<3>().norm();
    const Translation afresh = RobustTranslation(geometries[p]);
    const double cost = CostOf(geometries[p], moved, at.sigma_px);
    const double cost_afresh = CostOf(geometries[p], afresh, at.sigma_px);
    next.translations.push_back(cost < cost_afresh ? moved : afresh);
    next.cost += std::min(cost, cost_afresh);
  }
  return next;
}

std::vector<Eigen::MatrixXd> Solver::Jacobians(const Parameters& parameters, const Prior& prior,
                                               const std::vector<PairRays>& rays,
                                               const std::vector<PairResiduals>& terms) const {
  std::vector<Eigen::MatrixXd> jacobians;
  for (const PairResiduals& term : terms) {
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

Solver::PairTerms Solver::TermsOf(const PairGeometry& geometry, const PairResiduals& at,
                                  const Eigen::MatrixXd& jacobian, double sigma_px) const {
  const Eigen::VectorXd& r = at.residuals;
  const Eigen::VectorXd root_weights =
      (1 + (r / (kRobustAt * sigma_px)).array().square()).rsqrt() / sigma_px;
  const Eigen::Matrix<double, 9, 8> steps = Steps(at.translation);
  Eigen::MatrixXd B(r.size(), 8);
  for (int k = 0; k < 8; ++k) {
    const Translation moved = at.translation + kTranslationStep * steps.col(k);
    B.col(k) = (geometry.Residuals(moved) - r) / kTranslationStep;
  }
  const Eigen::MatrixXd wB = root_weights.asDiagonal() * B;
  const Eigen::MatrixXd wJ = root_weights.asDiagonal() * jacobian;
  const Eigen::VectorXd wr = root_weights.cwiseProduct(r);
  Own prior = Own::Constant(kDirectionDamping);
  prior.tail<6>().setConstant(std::pow(geometry.ChangeSigma(), -2));
  PairTerms terms{.own = wB.transpose() * wB,
                  .cross = wB.transpose() * wJ,
                  .hessian = wJ.transpose() * wJ,
                  .own_gradient = wB.transpose() * wr,
                  .gradient = wJ.transpose() * wr};
  terms.own.diagonal() += prior;
  terms.own_gradient.tail<6>() += prior[7] * at.translation.tail<6>();
  return terms;
}

Solver::Linearised Solver::Linearise(const State& state, const Prior& prior) const {
  const std::vector<PairRays> rays = Rays(state.parameters.camera);
  const std::vector<PairGeometry> geometries = Geometries(state.parameters, rays);
  std::vector<PairResiduals> residuals;
  std::vector<double> absolute;
  for (size_t p = 0; p < pairs_.size(); ++p) {
    const Translation& translation = state.translations[p];
    residuals.push_back({translation, geometries[p].Residuals(translation)});
    for (const double r : residuals.back().residuals) {
      absolute.push_back(std::abs(r));
    }
  }
  Linearised at;
  at.sigma_px = std::max(kMinSigma_px, kMadToSigma * Median(absolute));
  const auto inliers = std::count_if(absolute.begin(), absolute.end(),
                                     [&at](double r) { return r < kInlierSigmas * at.sigma_px; });
  at.inlier_share = static_cast<double>(inliers) / static_cast<double>(absolute.size());
  for (const double r : absolute) {
    const double scaled = std::pow(r / (kRobustAt * at.sigma_px), 2), weight = 1 / (1 + scaled);
    at.weights += weight;
    at.squared_slopes += std::pow(weight * r / at.sigma_px, 2);
    at.curvatures += weight * weight * (1 - scaled);
  }
  const std::vector<Eigen::MatrixXd> jacobians =
      Jacobians(state.parameters, prior, rays, residuals);
  at.cost = PriorCost(state.parameters, prior);
  for (size_t p = 0; p < pairs_.size(); ++p) {
    at.pairs.push_back(TermsOf(geometries[p], residuals[p], jacobians[p], at.sigma_px));
    at.cost += CostOf(geometries[p], residuals[p].translation, at.sigma_px);
  }
  at.prior = PriorInformation(prior);
  at.prior_gradient = at.prior * state.parameters.Minus(prior.mean);
  return at;
}

bool Solver::Plausible(const CameraModel& camera) const {
  const bool equidistant = camera.kind == CameraModel::Kind::kEquidistant;
  const double most = equidistant ? kMaxDistortionEquidistant : kMaxDistortion;
  const double field = FieldOfView(camera);
  return camera.fx > 0 && field > kMinFieldOfView && field < kMaxFieldOfView &&
         camera.distortion.cwiseAbs().maxCoeff() < most;
}

// Covariance of the sum of all pairs' gradients, from the scatter of the sums over blocks of time.
Information Solver::Scatter(const Reduced& reduced, double block_s) const {
  std::map<int64_t, Tangent> blocks;
  for (size_t p = 0; p < pairs_.size(); ++p) {
    const auto block = static_cast<int64_t>(std::floor(pairs_[p].a_s / block_s));
    blocks.try_emplace(block, Tangent::Zero()).first->second += reduced.gradients[p];
  }
  const auto n = static_cast<double>(blocks.size());
  const Tangent mean = reduced.gradient / n;
  Information scatter = Information::Zero();
  for (const auto& [block, gradient] : blocks) {
    scatter += (gradient - mean) * (gradient - mean).transpose();
  }
  return n / std::max(1.0, n - 1) * scatter;
}

Information Solver::Covariance(const Linearised& at) const {
  const Reduced reduced(at, 0);
  // Sandwich covariance of an M-estimator (Huber, 1967): scatter of the gradients between inverse
  // Hessians. The Hessian needs the loss's second derivative, which is smaller than its weight, and
  // negative beyond kRobustAt.
  const double curvature = std::max(kMinCurvature, at.curvatures / at.weights);
  const Information inverse =
      WithHeldRows(curvature * reduced.hessian + at.prior).ldlt().solve(Information::Identity());
  const auto with = [&](const Information& scatter) -> Information {
    return inverse * (scatter + at.prior) * inverse;
  };
  const double seconds = pairs_.back().b_s - pairs_.front().a_s;
  const Information independent = with(at.squared_slopes / at.weights * reduced.hessian);
  const Information slow = with(Scatter(reduced, seconds / kLongBlocks));
  Information covariance = with(Scatter(reduced, kBlock_s));
  // Use the largest of the three for each row: blocks may agree by chance.
  for (int i = 0; i < kSize; ++i) {
    const double largest = std::max({independent(i, i), covariance(i, i), slow(i, i)});
    const double scale = std::sqrt(largest / std::max(1e-30, covariance(i, i)));
    covariance.row(i) *= scale;
    covariance.col(i) *= scale;
  }
  return covariance;
}

Solution Solver::Solve(const Parameters& start, const Prior& prior, double within) const {
  Solution solution;
  State state = Begin(start);
  Linearised at = Linearise(state, prior);
  double damping = 1e-3;
  for (; solution.iterations < kMaxIterations && damping < kMaxDamping; ++solution.iterations) {
    const Reduced reduced(at, damping);
    const Tangent gradient = reduced.gradient + at.prior_gradient;
    Information h = WithHeldRows(reduced.hessian + at.prior);
    if (gradient.dot(h.ldlt().solve(gradient)) < within * within) {
      break;
    }
    h.diagonal() *= 1 + damping;
    const State next = Moved(state, at, prior, -h.ldlt().solve(gradient), damping);
    if (Plausible(next.parameters.camera) && next.cost < at.cost) {
      state = next;
      at = Linearise(state, prior);
      damping = std::max(1e-6, 0.1 * damping);
    } else {
      damping *= 10;
    }
  }
  solution.parameters = state.parameters;
  solution.covariance = Covariance(at);
  solution.sigma_px = at.sigma_px;
  solution.inlier_share = at.inlier_share;
  solution.cost = Cost(solution.parameters, 1);
  return solution;
}

}  // namespace pangea::calibration

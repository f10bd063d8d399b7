#include "loop_verification/upright_pnp.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace pangea {
namespace {

constexpr int kPnpSamples = 300;
// Limit for an inlier, 2 degrees of freedom: 4 sigma; wrong matches lie far outside.
constexpr double kPnpMaxChi2 = 16.0;

// Approximate pixel sigmas per radian for this observation, to convert a tilt.
double SigmaPerRadian(const PointObservation& observation) {
  return std::sqrt(std::abs(observation.sqrt_info.determinant()));
}

// Squared distance, in sigmas, of a ray from the plane of the baseline and the other ray.
double EpipolarChi2(const RayPair& pair, const Rigid3& T_m_c, const Eigen::Vector3d& baseline_m) {
  const Eigen::Vector3d ray_c_m = T_m_c.q * pair.ray_c;
  const double triple = ray_c_m.dot(baseline_m.cross(pair.ray_m));
  const double area2 =
      std::max(baseline_m.cross(pair.ray_m).squaredNorm(), baseline_m.cross(ray_c_m).squaredNorm());
  return triple * triple / (area2 + 1e-12) / (pair.sigma * pair.sigma);
}

struct Problem {
  const std::vector<PointObservation>& observations;
  const std::vector<RayPair>& ray_pairs;
  const Eigen::Vector3d& origin_c;
  const Eigen::Vector3d& origin_m;

  // Truncated quadratic score (MSAC). A ray pair constrains one dimension of two, so it counts
  // half. Returns some score up to `best` as soon as `best` cannot be exceeded.
  double Score(const Rigid3& T_m_c, const std::vector<double>& extra_var, double best) const {
    constexpr double kRounding = 1e-6;
    const Eigen::Matrix3d R_m_c = T_m_c.R();
    double score = 0;
    auto reach = static_cast<double>(observations.size()) +
                 0.5 * static_cast<double>(ray_pairs.size()) + kRounding;
    for (size_t i = 0; i < observations.size() && score + reach > best; ++i, reach -= 1) {
      const auto residual = Residual(observations[i], T_m_c, R_m_c);
      score += std::max(0.0, 1 - Chi2(residual, extra_var[i]) / kPnpMaxChi2);
    }
    const Eigen::Vector3d baseline = T_m_c * origin_c - origin_m;
    for (size_t i = 0; i < ray_pairs.size() && score + reach > best; ++i, reach -= 0.5) {
      score += 0.5 * std::max(0.0, 1 - EpipolarChi2(ray_pairs[i], T_m_c, baseline) / kPnpMaxChi2);
    }
    return score + reach > best ? score : best;
  }

  std::vector<int> Inliers(const Rigid3& T_m_c, const std::vector<double>& extra_var) const {
    std::vector<int> inliers;
    for (size_t i = 0; i < observations.size(); ++i) {
      if (Chi2(observations[i], T_m_c, extra_var[i]) < kPnpMaxChi2) {
        inliers.push_back(static_cast<int>(i));
      }
    }
    return inliers;
  }
};

// Poses X = T_m_c from two observations of one direction. The window's axes are gravity-aligned, so
// the camera's rays in these axes are rays in the frame g at its centre.
std::vector<Rigid3> Hypotheses(const PointObservation& a, const PointObservation& b) {
  const auto ray_g = [](const PointObservation& o) {
    return Eigen::Vector3d(o.T_cam_w.q.conjugate() * Eigen::Vector3d(o.ray.x(), o.ray.y(), 1.0));
  };
  std::vector<Rigid3> result;
  for (const Rigid3& T_holder_g : SolveUprightTwoPoint(a.p_w, b.p_w, ray_g(a), ray_g(b))) {
    const Eigen::Vector3d center_w = a.T_cam_w.Inverse().t;
    const Rigid3 T_holder_observer = T_holder_g * Rigid3(Eigen::Quaterniond::Identity(), -center_w);
    result.push_back(a.direction == Direction::kForward ? T_holder_observer
                                                        : T_holder_observer.Inverse());
  }
  return result;
}

// The hypothesis of random pairs of observations that scores best; nothing if none scores.
std::optional<Rigid3> BestHypothesis(const Problem& problem, const std::vector<double>& tilt_var,
                                     uint64_t seed) {
  const std::vector<PointObservation>& observations = problem.observations;
  std::vector<std::vector<int>> samples(2);  // by direction
  for (size_t i = 0; i < observations.size(); ++i) {
    samples[observations[i].direction == Direction::kForward ? 0 : 1].push_back(
        static_cast<int>(i));
  }
  std::mt19937_64 random(seed);
  double best_score = 0;
  Rigid3 best;
  for (int iteration = 0; iteration < kPnpSamples; ++iteration) {
    const std::vector<int>& sample =
        samples[random() % observations.size() < samples[0].size() ? 0 : 1];
    if (sample.size() < 2) {
      continue;
    }
    const size_t i = random() % sample.size();
    const size_t j = (i + 1 + random() % (sample.size() - 1)) % sample.size();
    for (const Rigid3& T_m_c : Hypotheses(observations[sample[i]], observations[sample[j]])) {
      const double score = problem.Score(T_m_c, tilt_var, best_score);
      if (score > best_score) {
        best_score = score;
        best = T_m_c;
      }
    }
  }
  return best_score > 0 ? std::optional(best) : std::nullopt;
}

// Refines all six degrees of freedom on the inliers, twice: the first inlier set still allows for
// the tilt.
UprightPnpResult Refined(const Problem& problem, const Rigid3& T_m_c,
                         const std::vector<double>& tilt_var, double tilt_sigma) {
  const std::vector<double> no_tilt(problem.observations.size(), 0.0);
  UprightPnpResult result{{T_m_c, Matrix6d::Identity()}, problem.Inliers(T_m_c, tilt_var)};
  for (int round = 0; round < 2; ++round) {
    std::vector<PointObservation> inliers;
    for (const int i : result.inliers) {
      inliers.push_back(problem.observations[i]);
    }
    result.pose = RefinePose(inliers, result.pose.T_m_c, tilt_sigma);
    result.inliers = problem.Inliers(result.pose.T_m_c, no_tilt);
  }
  return result;
}

}  // namespace

std::vector<Rigid3> SolveUprightTwoPoint(const Eigen::Vector3d& p1_w, const Eigen::Vector3d& p2_w,
                                         const Eigen::Vector3d& ray1_g,
                                         const Eigen::Vector3d& ray2_g) {
  // D = p1 - p2 = Rz (l1 d1 - l2 d2). Its z component and its length do not depend on the yaw:
  //   l1 d1z - l2 d2z = Dz,   |l1 d1 - l2 d2|^2 = |D|^2.
  const Eigen::Vector3d d1 = ray1_g.normalized();
  const Eigen::Vector3d d2 = ray2_g.normalized();
  const Eigen::Vector3d D = p1_w - p2_w;
  const Eigen::Vector2d a(d1.z(), -d2.z());
  if (a.squaredNorm() < 1e-6 || D.head<2>().squaredNorm() < 1e-8) {
    return {};  // both rays level, or one point above the other: yaw is not observable
  }
  // l = l0 + s e with a . e = 0: a quadratic in s.
  const Eigen::Vector2d l0 = a * (D.z() / a.squaredNorm());
  const Eigen::Vector2d e = Eigen::Vector2d(-a.y(), a.x()).normalized();
  const Eigen::Vector3d v0 = l0.x() * d1 - l0.y() * d2;
  const Eigen::Vector3d v1 = e.x() * d1 - e.y() * d2;
  const double qa = v1.squaredNorm();
  const double qb = v0.dot(v1);
  const double qc = v0.squaredNorm() - D.squaredNorm();
  double discriminant = qb * qb - qa * qc;
  if (qa < 1e-12 || discriminant < -0.05 * qb * qb) {
    return {};
  }
  discriminant = std::max(discriminant, 0.0);  // noise can make a double root complex
  std::vector<Rigid3> poses;
  for (const double sign : {-1.0, 1.0}) {
    const double s = (-qb + sign * std::sqrt(discriminant)) / qa;
    const Eigen::Vector2d l = l0 + s * e;
    if (l.x() <= 0 || l.y() <= 0) {
      continue;  // behind the camera
    }
    const Eigen::Vector3d v = l.x() * d1 - l.y() * d2;
    const Eigen::Quaterniond q = YawRotation(std::atan2(D.y(), D.x()) - std::atan2(v.y(), v.x()));
    poses.emplace_back(q, 0.5 * (p1_w + p2_w - q * (l.x() * d1 + l.y() * d2)));
  }
  return poses;
}

std::optional<UprightPnpResult> SolveUprightPnp(const std::vector<PointObservation>& observations,
                                                const std::vector<RayPair>& ray_pairs,
                                                const Eigen::Vector3d& origin_c,
                                                const Eigen::Vector3d& origin_m, double tilt_sigma,
                                                uint64_t seed) {
  const Problem problem{observations, ray_pairs, origin_c, origin_m};
  std::vector<double> tilt_var;
  for (const PointObservation& observation : observations) {
    const double tilt_sigmas = tilt_sigma * SigmaPerRadian(observation);
    tilt_var.push_back(tilt_sigmas * tilt_sigmas);
  }
  const auto best = BestHypothesis(problem, tilt_var, seed);
  return best ? std::optional(Refined(problem, *best, tilt_var, tilt_sigma)) : std::nullopt;
}

}  // namespace pangea

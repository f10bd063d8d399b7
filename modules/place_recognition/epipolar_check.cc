#include "place_recognition/epipolar_check.h"

#include <algorithm>
#include <array>
#include <boost/math/special_functions/beta.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "core/epipolar_step.h"

namespace pangea {
namespace {

using Pairs = std::vector<std::pair<CornerRay, CornerRay>>;
using Vector5d = Eigen::Matrix<double, 5, 1>;

// Sigma of the tilt between the two gravity-aligned odom frames, radians.
constexpr double kGravitySigma = 0.01;
// RANSAC: number of iterations, and confidence that an outlier-free sample was drawn.
constexpr int kMaxIterations = 300;
constexpr double kConfidence = 0.999;
// Limit on log10 of the expected number of false alarms (sets of unrelated matches that pass).
constexpr double kMaxLog10FalseAlarms = -2.0;
constexpr int kSampleSize = 3;
constexpr int kRefinedDof = 5;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Below this parallax, in sigmas, noise decides the sign of a depth.
constexpr double kParallaxSigmas = 6.0;

// The epipolar plane's normal of a pair as a function of yaw psi, with x = tan(psi / 2):
//   (1 + x^2) (Rz(psi) a) x b = power[0] + power[1] x + power[2] x^2.
struct Normal {
  std::array<Eigen::Vector3d, 3> power;
  Eigen::Vector3d At(double x) const { return power[0] + x * (power[1] + x * power[2]); }
};

Normal MakeNormal(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d constant = Eigen::Vector3d(0, 0, a.z()).cross(b);
  const Eigen::Vector3d cosine = Eigen::Vector3d(a.x(), a.y(), 0).cross(b);
  const Eigen::Vector3d sine = Eigen::Vector3d(-a.y(), a.x(), 0).cross(b);
  return {{constant + cosine, 2 * sine, constant - cosine}};
}

// Coefficients from x^0 upwards, and the degree.
struct Polynomial {
  static constexpr int kMaxDegree = 4;
  std::array<double, kMaxDegree + 1> coefficients{};
  int degree = 0;

  double At(double x) const {
    double value = 0;
    for (int i = degree; i >= 0; --i) {
      value = value * x + coefficients[i];
    }
    return value;
  }
  Polynomial Derivative() const {
    Polynomial derivative{.degree = degree - 1};
    for (int i = 1; i <= degree; ++i) {
      derivative.coefficients[i - 1] = static_cast<double>(i) * coefficients[i];
    }
    return derivative;
  }
};

// In ascending order.
struct Roots {
  std::array<double, Polynomial::kMaxDegree> x{};
  int count = 0;
};

// det[n1 n2 n3] (1 + x^2)^3 has degree 6 and, as at x = i all three normals are perpendicular to
// (1, i, 0), the factor 1 + x^2; the quotient is a quartic.
Polynomial YawPolynomial(const std::array<Normal, kSampleSize>& normals) {
  std::array<Eigen::Vector3d, 5> cross;
  cross.fill(Eigen::Vector3d::Zero());
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      cross[i + j] += normals[0].power[i].cross(normals[1].power[j]);
    }
  }
  std::array<double, 7> sextic{};
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 3; ++j) {
      sextic[i + j] += cross[i].dot(normals[2].power[j]);
    }
  }
  Polynomial quartic{.degree = 4};
  for (int i = 4; i >= 0; --i) {
    quartic.coefficients[i] = sextic[i + 2] - (i + 2 <= 4 ? quartic.coefficients[i + 2] : 0.0);
  }
  return quartic;
}

// The root between two points of opposite sign: Newton's method, safeguarded by bisection.
double RootBetween(const Polynomial& polynomial, const Polynomial& derivative, double low,
                   double high) {
  constexpr int kMaxSteps = 60;
  const bool low_negative = polynomial.At(low) < 0;
  double x = 0.5 * (low + high);
  for (int i = 0; i < kMaxSteps; ++i) {
    const double value = polynomial.At(x);
    ((value < 0) == low_negative ? low : high) = x;
    double next = x - value / derivative.At(x);
    if (!(next > low && next < high)) {
      next = 0.5 * (low + high);
    }
    const double step = std::abs(next - x);
    x = next;
    if (step < 1e-13 * (1 + std::abs(x))) {
      break;
    }
  }
  return x;
}

// Roots in [-1, 1]; each lies between two roots of the derivative.
Roots RootsWithinOne(const Polynomial& polynomial) {
  Roots roots;
  if (polynomial.degree < 1) {
    return roots;
  }
  const Polynomial derivative = polynomial.Derivative();
  const Roots borders = RootsWithinOne(derivative);
  double low = -1;
  bool low_negative = polynomial.At(low) < 0;
  for (int i = 0; i <= borders.count; ++i) {
    const double border = i < borders.count ? borders.x[i] : 1;
    const bool border_negative = polynomial.At(border) < 0;
    if (low_negative != border_negative) {
      roots.x[roots.count++] = RootBetween(polynomial, derivative, low, border);
    }
    low = border;
    low_negative = border_negative;
  }
  return roots;
}

// Real roots in [-kLargestRoot, kLargestRoot] (yaw up to 179.9 degrees). Roots beyond 1 are the
// inverses of the reversed polynomial's roots, so that every search interval is small.
Roots RealRoots(const Polynomial& polynomial) {
  constexpr double kLargestRoot = 1e3;
  Polynomial reversed = polynomial;
  std::reverse(reversed.coefficients.begin(),
               reversed.coefficients.begin() + polynomial.degree + 1);
  const Roots inverse = RootsWithinOne(reversed);
  const Roots inner = RootsWithinOne(polynomial);
  Roots roots;
  const auto take = [&roots](double x) {
    if (std::abs(x) <= kLargestRoot && roots.count < Polynomial::kMaxDegree) {
      roots.x[roots.count++] = x;
    }
  };
  const auto take_inverse = [&](bool negative) {
    for (int i = inverse.count - 1; i >= 0; --i) {
      if ((inverse.x[i] < 0) == negative) {
        take(1 / inverse.x[i]);
      }
    }
  };
  take_inverse(true);
  std::for_each_n(inner.x.begin(), inner.count, take);
  take_inverse(false);
  return roots;
}

// The translation is perpendicular to all three normals: the longest of their cross products.
Eigen::Vector3d Translation(const std::array<Normal, kSampleSize>& normals, double x) {
  Eigen::Vector3d longest = Eigen::Vector3d::Zero();
  for (int i = 0; i < kSampleSize; ++i) {
    const Eigen::Vector3d t = normals[i].At(x).cross(normals[(i + 1) % kSampleSize].At(x));
    if (t.squaredNorm() > longest.squaredNorm()) {
      longest = t;
    }
  }
  return longest.isZero(0) ? Eigen::Vector3d::UnitX() : Eigen::Vector3d(longest.normalized());
}

// Variance of e = b . (t x w), with w = R a: de = (b x t) . dw + (t x w) . db, with noise dw, db
// perpendicular to the rays.
double SampsonVariance(const Eigen::Vector3d& w, double sigma_a, const CornerRay& b,
                       const Eigen::Vector3d& t) {
  const double variance = sigma_a * sigma_a * w.cross(b.direction.cross(t)).squaredNorm() +
                          b.sigma * b.sigma * b.direction.cross(w.cross(t)).squaredNorm();
  return std::max(variance, 1e-18);
}

std::vector<int> Inliers(const EpipolarModel& model, const Pairs& pairs, double max_residual) {
  std::vector<int> inliers;
  for (int i = 0; i < static_cast<int>(pairs.size()); ++i) {
    if (model.Residual(pairs[i].first, pairs[i].second) <= max_residual) {
      inliers.push_back(i);
    }
  }
  return inliers;
}

// Counts inliers; stops early once the count cannot exceed `most`.
size_t CountInliers(const EpipolarModel& model, const Pairs& pairs, double max_residual,
                    size_t most) {
  size_t count = 0;
  for (size_t i = 0; i < pairs.size() && count + (pairs.size() - i) > most; ++i) {
    count += model.Residual(pairs[i].first, pairs[i].second) <= max_residual ? 1 : 0;
  }
  return count;
}

// One Gauss-Newton step on the Sampson residuals of `inliers`.
void RefineStep(const Pairs& pairs, const std::vector<int>& inliers, EpipolarModel* model) {
  EpipolarStep step(model->t_b_a, 1);
  const Eigen::Matrix3d R = model->R_b_a.toRotationMatrix();
  for (const int i : inliers) {
    const auto& [a, b] = pairs[i];
    const Eigen::Vector3d w = R * a.direction;
    step.Add(w, b.direction, 1, 1 / SampsonVariance(w, a.sigma, b, model->t_b_a));
  }
  // Gravity prior on the part of the rotation that is not yaw.
  const Eigen::Vector3d tilt = LogSo3(YawRotation(-YawOf(model->R_b_a)) * model->R_b_a);
  for (int axis = 0; axis < 2; ++axis) {
    step.H(axis, axis) += 1.0 / (kGravitySigma * kGravitySigma);
    step.g[axis] += tilt[axis] / (kGravitySigma * kGravitySigma);
  }
  step.Apply(&model->R_b_a, &model->t_b_a);
}

// Local optimisation (Chum et al., DAGM 2003): from a wide inlier set to a narrow one.
EpipolarModel Refine(const Pairs& pairs, EpipolarModel model) {
  for (const double widen : {3.0, 2.0, 1.5, 1.0, 1.0}) {
    const std::vector<int> inliers = Inliers(model, pairs, widen * kMaxEpipolarResidual);
    if (static_cast<int>(inliers.size()) < kRefinedDof) {
      break;
    }
    RefineStep(pairs, inliers, &model);
  }
  return model;
}

// Probability that wrongly paired corners of these keyframes fit the model.
double ChanceOfInlier(const EpipolarModel& model, const Pairs& pairs, double max_residual) {
  const int n = static_cast<int>(pairs.size());
  int hits = 0;
  int trials = 0;
  for (int shift = 1; shift < n && trials < 1000; ++shift) {
    for (int i = 0; i < n; ++i) {
      hits += model.Residual(pairs[i].first, pairs[(i + shift) % n].second) <= max_residual;
      ++trials;
    }
  }
  return (hits + 1.0) / (trials + 2.0);
}

// log10 of P(at least k of n), each with probability p. P itself would underflow.
double Log10BinomialTail(int n, int k, double p) {
  return k <= 0 ? 0
                : static_cast<double>(std::log10(boost::math::ibeta<long double>(k, n - k + 1, p)));
}

int IterationsNeeded(double inlier_ratio) {
  const double good_sample = std::pow(inlier_ratio, kSampleSize);
  if (good_sample > 1 - 1e-9) {
    return 1;
  }
  const double needed = std::log(1 - kConfidence) / std::log1p(-good_sample);
  return static_cast<int>(std::min<double>(kMaxIterations, std::ceil(needed)));
}

using Sample = std::array<int, kSampleSize>;

Sample DrawSample(int n, std::mt19937_64& rng) {
  Sample sample{};
  for (auto end = sample.begin(); end != sample.end();) {
    const int i = static_cast<int>(rng() % static_cast<uint64_t>(n));
    if (std::find(sample.begin(), end, i) == end) {
      *end++ = i;
    }
  }
  return sample;
}

}  // namespace

double EpipolarModel::Residual(const CornerRay& a, const CornerRay& b) const {
  const Eigen::Vector3d w = R_b_a * a.direction;
  const Eigen::Vector3d b_cross_t = b.direction.cross(t_b_a);
  const Eigen::Vector3d w_cross_t = w.cross(t_b_a);
  // depth_b b = depth_a w + s t, so depth_a (w x b) = s (b x t) and depth_b (w x b) = s (w x t).
  const Eigen::Vector3d w_cross_b = w.cross(b.direction);
  const double parallax = kParallaxSigmas * std::max(a.sigma, b.sigma);
  if (w_cross_b.squaredNorm() > parallax * parallax &&
      (w_cross_b.dot(b_cross_t) < 0 || w_cross_b.dot(w_cross_t) < 0)) {
    return kInfinity;
  }
  return std::abs(b_cross_t.dot(w)) / std::sqrt(SampsonVariance(w, a.sigma, b, t_b_a));
}

std::vector<EpipolarModel> SolveThreePairs(const Pairs& pairs, const std::array<int, 3>& sample) {
  std::array<Normal, kSampleSize> normals;
  for (int i = 0; i < kSampleSize; ++i) {
    normals[i] = MakeNormal(pairs[sample[i]].first.direction, pairs[sample[i]].second.direction);
  }
  std::vector<EpipolarModel> models;
  const Roots roots = RealRoots(YawPolynomial(normals));
  for (int i = 0; i < roots.count; ++i) {
    const double x = roots.x[i];
    const Eigen::Vector3d t = Translation(normals, x);
    models.push_back({YawRotation(2 * std::atan(x)), t});
    models.push_back({YawRotation(2 * std::atan(x)), -t});
  }
  std::erase_if(models, [&](const EpipolarModel& model) {
    return std::any_of(sample.begin(), sample.end(), [&](int i) {
      return model.Residual(pairs[i].first, pairs[i].second) == kInfinity;
    });
  });
  return models;
}

EpipolarResult CheckEpipolar(const Pairs& pairs, uint64_t seed) {
  EpipolarResult best;
  const int n = static_cast<int>(pairs.size());
  if (n < std::max(kMinEpipolarInliers, kRefinedDof + 1)) {
    return best;
  }
  std::mt19937_64 rng(seed);
  // A hypothesis still contains the error of gravity: count with a wider limit, then refine.
  const double generous = 2.0 * kMaxEpipolarResidual;
  size_t most = 0;
  int iterations = kMaxIterations;
  for (int i = 0; i < iterations; ++i) {
    for (const EpipolarModel& model : SolveThreePairs(pairs, DrawSample(n, rng))) {
      const size_t count = CountInliers(model, pairs, generous, most);
      if (count <= most) {
        continue;
      }
      most = count;
      const EpipolarModel refined = Refine(pairs, model);
      std::vector<int> inliers = Inliers(refined, pairs, kMaxEpipolarResidual);
      if (inliers.size() > best.inliers.size()) {
        best.model = refined;
        best.inliers = std::move(inliers);
        iterations = IterationsNeeded(static_cast<double>(best.inliers.size()) / n);
      }
    }
  }
  const int count = static_cast<int>(best.inliers.size());
  if (count < kMinEpipolarInliers) {
    return best;
  }
  // Subtract the pairs that the model's own degrees of freedom can always fit.
  const double chance = ChanceOfInlier(best.model, pairs, kMaxEpipolarResidual);
  best.log10_false_alarms = std::log10(static_cast<double>(kMaxIterations)) +
                            Log10BinomialTail(n - kRefinedDof, count - kRefinedDof, chance);
  best.accepted = best.log10_false_alarms <= kMaxLog10FalseAlarms;
  return best;
}

}  // namespace pangea

#include "vio/front_end/two_view_check.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/epipolar_step.h"

namespace pangea::vio {
namespace {

// Thresholds in multiples of inlier_px: hypotheses and the first fits must tolerate the gyro's
// bias.
constexpr double kHypothesisSlack = 3.0;
constexpr double kFitSlack[] = {3.0, 1.5, 1.0, 1.0};
constexpr size_t kMinTracks = 6;
// Each is of two tracks; with 40 % outliers one in three has only inliers
constexpr int kHypotheses = 60;

struct Tracks {
  std::vector<Eigen::Vector3d> a;  // unit
  std::vector<Eigen::Vector3d> b;  // unit
};

// Angle between ray b and the epipolar plane of (ray a rotated into b, translation), radians.
double EpipolarError(const Eigen::Vector3d& a_in_b, const Eigen::Vector3d& b,
                     const Eigen::Vector3d& t) {
  const double length = t.cross(a_in_b).norm();
  return length < 1e-6 ? 0.0 : t.dot(a_in_b.cross(b)) / length;
}

// Sum of truncated squared errors, for a direction of translation.
double Score(const std::vector<Eigen::Vector3d>& a_in_b, const std::vector<Eigen::Vector3d>& b,
             const Eigen::Vector3d& t, double threshold) {
  double score = 0;
  for (size_t i = 0; i < b.size(); ++i) {
    const double e = EpipolarError(a_in_b[i], b[i], t);
    score += std::min(e * e, threshold * threshold);
  }
  return score;
}

Eigen::Vector3d BestDirection(const std::vector<Eigen::Vector3d>& a_in_b,
                              const std::vector<Eigen::Vector3d>& b, double threshold) {
  std::mt19937_64 random(b.size());
  // The distributions of the standard library differ between implementations.
  const auto pick = [&] { return static_cast<size_t>(random() % b.size()); };
  Eigen::Vector3d best = Eigen::Vector3d::UnitX();
  double best_score = std::numeric_limits<double>::max();
  for (int k = 0; k < kHypotheses; ++k) {
    const size_t i = pick();
    const size_t j = pick();
    const Eigen::Vector3d t = a_in_b[i].cross(b[i]).cross(a_in_b[j].cross(b[j]));
    const double length = t.norm();
    if (i == j || length < 1e-12) {
      continue;
    }
    const double score = Score(a_in_b, b, t / length, threshold);
    if (score < best_score) {
      best_score = score;
      best = t / length;
    }
  }
  return best;
}

// One step with Cauchy weights at `threshold`; `from_gyro` is the prior of the rotation.
void FitStep(const Tracks& tracks, double threshold, double rotation_sigma, double noise,
             const Eigen::Quaterniond& from_gyro, Eigen::Quaterniond* q, Eigen::Vector3d* t) {
  EpipolarStep step(*t, 1e-9);
  for (size_t i = 0; i < tracks.a.size(); ++i) {
    const Eigen::Vector3d a = *q * tracks.a[i];
    const double length = t->cross(a).norm();
    if (length < 1e-6) {
      continue;
    }
    const double e = EpipolarError(a, tracks.b[i], *t);
    step.Add(a, tracks.b[i], length, 1.0 / (1.0 + e * e / (threshold * threshold)));
  }
  const double prior = noise * noise / (rotation_sigma * rotation_sigma);
  step.H.topLeftCorner<3, 3>() += prior * Eigen::Matrix3d::Identity();
  step.g.head<3>() += prior * LogSo3(*q * from_gyro.conjugate());
  // Without parallax the direction is undetermined: this keeps it.
  step.H.bottomRightCorner<2, 2>() += Eigen::Matrix2d::Identity() * noise * noise;
  step.Apply(q, t);
}

// Rejects tracks behind the cameras. Depth times baseline has the sign of (a x t) . (a x b), up to
// the sign of t: the side of most points is the front.
void RejectBehind(const std::vector<Eigen::Vector3d>& a_in_b, const std::vector<Eigen::Vector3d>& b,
                  const Eigen::Vector3d& t, double threshold, std::vector<bool>* inlier) {
  std::vector<int> side(b.size(), 0);
  int sum = 0;
  for (size_t i = 0; i < b.size(); ++i) {
    const Eigen::Vector3d parallax = a_in_b[i].cross(b[i]);
    const double length = a_in_b[i].cross(t).norm();
    // Too little parallax, or too near the epipole, to decide.
    if (!(*inlier)[i] || parallax.norm() < 2.0 * threshold || length < 0.1) {
      continue;
    }
    side[i] = parallax.dot(a_in_b[i].cross(t)) > 0 ? 1 : -1;
    sum += side[i];
  }
  for (size_t i = 0; i < b.size(); ++i) {
    if (side[i] * sum < 0) {
      (*inlier)[i] = false;
    }
  }
}

std::vector<Eigen::Vector3d> Rotate(const Eigen::Quaterniond& q,
                                    const std::vector<Eigen::Vector3d>& rays) {
  std::vector<Eigen::Vector3d> rotated;
  rotated.reserve(rays.size());
  const Eigen::Matrix3d R = q.toRotationMatrix();
  for (const Eigen::Vector3d& ray : rays) {
    rotated.push_back(R * ray);
  }
  return rotated;
}

}  // namespace

TwoViewResult CheckTwoView(const std::vector<Eigen::Vector2d>& rays_a,
                           const std::vector<Eigen::Vector2d>& rays_b,
                           const Eigen::Quaterniond& q_b_a, double pixel_angle,
                           const TwoViewOptions& options) {
  TwoViewResult result;
  result.q_b_a = q_b_a;
  result.inlier.assign(rays_a.size(), true);
  result.num_inliers = static_cast<int>(rays_a.size());
  if (rays_a.size() < kMinTracks) {
    return result;
  }
  Tracks tracks;
  for (size_t i = 0; i < rays_a.size(); ++i) {
    tracks.a.push_back(rays_a[i].homogeneous().normalized());
    tracks.b.push_back(rays_b[i].homogeneous().normalized());
  }
  const double threshold = options.inlier_px * pixel_angle;
  Eigen::Vector3d t =
      BestDirection(Rotate(q_b_a, tracks.a), tracks.b, kHypothesisSlack * threshold);
  for (const double slack : kFitSlack) {
    FitStep(tracks, slack * threshold, options.rotation_sigma, 0.3 * pixel_angle, q_b_a,
            &result.q_b_a, &t);
  }
  const std::vector<Eigen::Vector3d> a_in_b = Rotate(result.q_b_a, tracks.a);
  for (size_t i = 0; i < a_in_b.size(); ++i) {
    result.inlier[i] = std::abs(EpipolarError(a_in_b[i], tracks.b[i], t)) < threshold;
  }
  RejectBehind(a_in_b, tracks.b, t, threshold, &result.inlier);
  result.num_inliers =
      static_cast<int>(std::count(result.inlier.begin(), result.inlier.end(), true));
  return result;
}

}  // namespace pangea::vio

// Solves for the gyro bias, the time offset and the closed-form start.

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/imu/preintegration.h"
#include "vio/initialisation/initial_solution.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr size_t kMinPairs = 4;
constexpr double kMaxTimeOffset_s = 0.06;  // search range, in both directions
// A time offset is used only if its cost is below this share of the cost without.
constexpr double kClearlyBetter = 0.8;
constexpr size_t kMinShared = 20;  // shared landmarks that two images need for a relative rotation

Vector3d Bearing(const Vector2d& ray) { return Vector3d(ray.x(), ray.y(), 1).normalized(); }

Preintegration IntegrateBetween(std::span<const StartFrame> frames, size_t from, size_t to,
                                const ImuNoise& noise, const Vector3d& gyro_bias) {
  Preintegrator integrator(noise, gyro_bias, Vector3d::Zero());
  for (size_t k = from + 1; k <= to; ++k) {
    integrator.Add(frames[k].imu);
  }
  return integrator.result();
}

// Two images: the moments of their shared bearings (in body orientation), and the dependence of
// their rotation on the gyro bias. Bearings a, b enter only as sums, so the cost of an evaluation
// does not depend on their number (Kneip & Lynen, ICCV 2013).
struct RotationPair {
  int64_t from_utime = 0, to_utime = 0;
  size_t num_bearings = 0;
  std::array<std::array<Matrix3d, 3>, 3> moments;  // [i][j]: sum a_i a_j b b^T
  Quaterniond delta_q;
  Matrix3d J_bias;

  RotationPair() {
    for (auto& row : moments) {
      row.fill(Matrix3d::Zero());
    }
  }
  void Add(const Vector3d& a, const Vector3d& b) {
    const Matrix3d bb = b * b.transpose();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        moments[i][j] += a[i] * a[j] * bb;
      }
    }
    ++num_bearings;
  }
};

// Smallest eigenvalue of M = sum n n^T, n = a x R b: zero if the pair satisfies the epipolar
// constraint with R.
double EpipolarCost(const RotationPair& pair, const Vector3d& bias_change) {
  const Matrix3d R = (pair.delta_q * ExpSo3(pair.J_bias * bias_change)).toRotationMatrix();
  std::array<std::array<Matrix3d, 3>, 3> T;  // sum a_i a_j (R b)(R b)^T
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) {
      T[i][j] = R * pair.moments[i][j] * R.transpose();
      T[j][i] = T[i][j];
    }
  }
  Matrix3d M;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      // n_i = a_i1 (R b)_i2 - a_i2 (R b)_i1
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      M(i, j) = T[i1][j1](i2, j2) - T[i1][j2](i2, j1) - T[i2][j1](i1, j2) + T[i2][j2](i1, j1);
    }
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(M, Eigen::EigenvaluesOnly);
  return std::max(0.0, eigen.eigenvalues()[0]) / static_cast<double>(pair.num_bearings);
}

std::vector<RotationPair> MakePairs(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                    const ImuNoise& noise, size_t every = 1) {
  std::vector<RotationPair> pairs;
  constexpr size_t kSpan = 4;  // frames between the two images: the bias must be visible
  for (size_t i = 0; i + kSpan < frames.size(); i += every) {
    const StartFrame& a = frames[i];
    const StartFrame& b = frames[i + kSpan];
    RotationPair pair;
    pair.from_utime = a.utime;
    pair.to_utime = b.utime;
    for (const auto& [id, ray] : a.rays) {
      const auto other = b.rays.find(id);
      if (other != b.rays.end()) {
        pair.Add(T_body_cam.q * Bearing(ray), T_body_cam.q * Bearing(other->second));
      }
    }
    if (pair.num_bearings >= kMinShared) {
      const Preintegration p = IntegrateBetween(frames, i, i + kSpan, noise, Vector3d::Zero());
      pair.delta_q = p.delta_q;
      pair.J_bias = p.bias_jacobian.topLeftCorner<3, 3>();
      pairs.push_back(std::move(pair));
    }
  }
  return pairs;
}

// The gyro's rotation over a span of time that the samples cover, without bias correction.
Quaterniond Rotation(std::span<const ImuSample> samples, int64_t from_utime, int64_t to_utime) {
  Quaterniond q = Quaterniond::Identity();
  for (size_t i = 0; i + 1 < samples.size(); ++i) {
    const int64_t begin = std::max(samples[i].utime, from_utime);
    const int64_t end = std::min(samples[i + 1].utime, to_utime);
    if (end > begin) {
      const Vector3d gyro = 0.5 * (samples[i].gyro + samples[i + 1].gyro);
      q = q * ExpSo3(1e-6 * static_cast<double>(end - begin) * gyro);
    }
  }
  return q.normalized();
}

struct FoundBias {
  Vector3d bias = Vector3d::Zero();
  double cost = 0;
};

FoundBias FindBias(const std::vector<RotationPair>& pairs, const Vector3d& start,
                   double first_step) {
  const auto cost = [&](const Vector3d& bias) {
    double sum = 0;
    for (const RotationPair& pair : pairs) {
      // The square root limits the influence of one pair with bad tracks.
      sum += std::sqrt(EpipolarCost(pair, bias) + 1e-10);
    }
    return sum;
  };
  FoundBias found{start, cost(start)};
  // Pattern search with shrinking steps: three unknowns, a cheap cost, no derivatives at its kink.
  for (double step = first_step; step > 2e-5; step *= 0.5) {
    for (bool improved = true; improved;) {
      improved = false;
      for (int k = 0; k < 6; ++k) {
        const Vector3d tried = found.bias + (k % 2 == 0 ? step : -step) * Vector3d::Unit(k / 2);
        const double value = cost(tried);
        if (value < found.cost && tried.norm() < 0.5) {
          found = {tried, value};
          improved = true;
        }
      }
    }
  }
  return found;
}

// min y' A y - 2 b' y with |y.tail(3)| = kGravity: the head is eliminated, the rest is a secular
// equation in one unknown.
std::optional<Vector6d> SolveWithGravityNorm(const Matrix6d& A, const Vector6d& b) {
  const Matrix3d A_vv_inv = A.topLeftCorner<3, 3>().inverse();
  const Matrix3d M = A.bottomRightCorner<3, 3>() -
                     A.bottomLeftCorner<3, 3>() * A_vv_inv * A.topRightCorner<3, 3>();
  const Vector3d d = b.tail<3>() - A.bottomLeftCorner<3, 3>() * A_vv_inv * b.head<3>();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(0.5 * (M + M.transpose()));
  if (eigen.info() != Eigen::Success || !M.allFinite()) {
    return std::nullopt;
  }
  const Vector3d& w = eigen.eigenvalues();
  const Vector3d e = eigen.eigenvectors().transpose() * d;
  // |(M + mu I)^-1 d| falls with mu on (-w_min, inf): bisect for the length of gravity.
  const auto length = [&](double mu) { return (e.array() / (w.array() + mu)).matrix().norm(); };
  double low = -w[0] + 1e-12 * (1 + std::abs(w[2]));
  double high = d.norm() / kGravity + std::abs(w[2]) + 1;
  if (length(low) < kGravity) {
    return std::nullopt;
  }
  for (int i = 0; i < 200; ++i) {
    const double mid = 0.5 * (low + high);
    (length(mid) > kGravity ? low : high) = mid;
  }
  const double mu = 0.5 * (low + high);
  Vector6d y;
  y.tail<3>() = eigen.eigenvectors() * (e.array() / (w.array() + mu)).matrix();
  y.head<3>() = A_vv_inv * (b.head<3>() - A.topRightCorner<3, 3>() * y.tail<3>());
  return y;
}

// The preintegration from the first frame to each frame.
std::vector<Preintegration> FromFirst(std::span<const StartFrame> frames, const ImuNoise& noise,
                                      const Vector3d& gyro_bias) {
  std::vector<Preintegration> from_first;
  Preintegrator integrator(noise, gyro_bias, Vector3d::Zero());
  for (const StartFrame& frame : frames) {
    integrator.Add(frame.imu);
    from_first.push_back(integrator.result());
  }
  return from_first;
}

// (frame, bearing in the orientation of the first body frame)
using Sighting = std::pair<size_t, Vector3d>;
using Sightings = std::map<int32_t, std::vector<Sighting>>;

Sightings SeenOften(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                    const std::vector<Preintegration>& from_first) {
  Sightings seen;
  for (size_t k = 0; k < frames.size(); ++k) {
    for (const auto& [id, ray] : frames[k].rays) {
      seen[id].emplace_back(k, from_first[k].delta_q * (T_body_cam.q * Bearing(ray)));
    }
  }
  std::erase_if(seen, [](const auto& item) { return item.second.size() < 4; });
  return seen;
}

// The normal equations of one point X and y = (v0, g): across (X - v0 t - g t^2/2 - c) = 0 at each
// sighting, where `across` takes the part perpendicular to the bearing, and c is the known part of
// the camera's position. All in the first body frame.
class PointEquations {
 public:
  PointEquations(const std::vector<Sighting>& sightings,
                 const std::vector<Preintegration>& from_first, const Rigid3& T_body_cam,
                 double weight) {
    for (const auto& [k, bearing] : sightings) {
      const double t = from_first[k].duration_s;
      const Matrix3d W = weight * (Matrix3d::Identity() - bearing * bearing.transpose());
      const Vector3d c = from_first[k].delta_p + from_first[k].delta_q * T_body_cam.t;
      Eigen::Matrix<double, 3, 6> T;
      T << t * Matrix3d::Identity(), 0.5 * t * t * Matrix3d::Identity();
      A_xx_ += W;
      A_xy_ -= W * T;
      b_x_ += W * c;
      A_yy_ += T.transpose() * W * T;
      b_y_ -= T.transpose() * W * c;
    }
  }

  // Eliminates X and adds the reduced equations of y; false if X is not determined.
  bool AddReduced(Matrix6d* A, Vector6d* b) const {
    const Matrix3d A_xx_inv = A_xx_.inverse();
    if (!A_xx_inv.allFinite()) {
      return false;
    }
    *A += A_yy_ - A_xy_.transpose() * A_xx_inv * A_xy_;
    *b += b_y_ - A_xy_.transpose() * A_xx_inv * b_x_;
    return true;
  }

  Vector3d Solve(const Vector6d& y) const { return A_xx_.inverse() * (b_x_ - A_xy_ * y); }

 private:
  Matrix3d A_xx_ = Matrix3d::Zero();
  Eigen::Matrix<double, 3, 6> A_xy_ = Eigen::Matrix<double, 3, 6>::Zero();
  Vector3d b_x_ = Vector3d::Zero();
  Matrix6d A_yy_ = Matrix6d::Zero();
  Vector6d b_y_ = Vector6d::Zero();
};

}  // namespace

std::optional<Vector3d> SolveGyroBias(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                      const ImuNoise& noise) {
  const std::vector<RotationPair> pairs = MakePairs(frames, T_body_cam, noise);
  if (pairs.size() < kMinPairs) {
    return std::nullopt;
  }
  return FindBias(pairs, Vector3d::Zero(), 0.05).bias;
}

std::optional<double> GyroCost(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                               const ImuNoise& noise, size_t every) {
  const std::vector<RotationPair> pairs = MakePairs(frames, T_body_cam, noise, every);
  if (pairs.size() < kMinPairs) {
    return std::nullopt;
  }
  return FindBias(pairs, Vector3d::Zero(), 0.05).cost / static_cast<double>(pairs.size());
}

std::optional<double> SolveTimeOffset(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                      std::span<const ImuSample> samples, const ImuNoise& noise) {
  const auto max_us = static_cast<int64_t>(1e6 * kMaxTimeOffset_s);
  std::vector<RotationPair> pairs = MakePairs(frames, T_body_cam, noise);
  std::erase_if(pairs, [&](const RotationPair& pair) {
    return samples.empty() || pair.from_utime - max_us < samples.front().utime ||
           pair.to_utime + max_us > samples.back().utime;
  });
  if (pairs.size() < kMinPairs) {
    return std::nullopt;
  }
  constexpr int kSteps = 10;  // to either side
  std::vector<double> costs;
  Vector3d bias = FindBias(pairs, Vector3d::Zero(), 0.05).bias;
  for (int k = -kSteps; k <= kSteps; ++k) {
    const int64_t shift = max_us * k / kSteps;
    for (RotationPair& pair : pairs) {
      pair.delta_q = Rotation(samples, pair.from_utime + shift, pair.to_utime + shift);
    }
    const FoundBias found = FindBias(pairs, bias, 0.01);
    bias = found.bias;
    costs.push_back(found.cost);
  }
  const auto best = std::min_element(costs.begin(), costs.end());
  if (best == costs.begin() || best + 1 == costs.end() || *best > kClearlyBetter * costs[kSteps]) {
    return std::nullopt;
  }
  // Interpolate with a parabola through the best step and its neighbours.
  const double before = *(best - 1), after = *(best + 1);
  const double fraction = 0.5 * (before - after) / (before + after - 2 * *best);
  const double step = kMaxTimeOffset_s / kSteps;
  return step * (static_cast<double>(best - costs.begin()) - kSteps + fraction);
}

std::optional<LinearStart> SolveLinear(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                       const ImuNoise& noise, const Vector3d& gyro_bias) {
  const std::vector<Preintegration> from_first = FromFirst(frames, noise, gyro_bias);
  const Sightings seen = SeenOften(frames, T_body_cam, from_first);
  if (seen.size() < kMinShared) {
    return std::nullopt;
  }
  LinearStart out;
  std::map<int32_t, double> depth;
  Vector6d y;
  for (int round = 0; round < 3; ++round) {
    Matrix6d A = Matrix6d::Zero();
    Vector6d b = Vector6d::Zero();
    std::map<int32_t, PointEquations> points;
    for (const auto& [id, sightings] : seen) {
      const double weight = depth.contains(id) ? 1.0 / (depth[id] * depth[id]) : 1.0;
      const PointEquations point(sightings, from_first, T_body_cam, weight);
      if (point.AddReduced(&A, &b)) {
        points.emplace(id, point);
      }
    }
    const auto solved = SolveWithGravityNorm(A, b);
    if (!solved) {
      return std::nullopt;
    }
    y = *solved;
    out.p_first.clear();
    for (const auto& [id, point] : points) {
      out.p_first[id] = point.Solve(y);
      depth[id] = std::clamp(out.p_first[id].norm(), 0.3, 50.0);
    }
  }
  out.v0 = y.head<3>();
  out.gravity = y.tail<3>();
  for (const Preintegration& p : from_first) {
    const double t = p.duration_s;
    out.T_first_body.push_back({p.delta_q, out.v0 * t + 0.5 * t * t * out.gravity + p.delta_p});
    out.v_first_body.push_back(out.v0 + t * out.gravity + p.delta_v);
  }
  return out;
}

LinearStart Scaled(LinearStart start, double scale) {
  start.v0 *= scale;
  for (Rigid3& T : start.T_first_body) {
    T.t *= scale;
  }
  for (Vector3d& v : start.v_first_body) {
    v *= scale;
  }
  for (auto& [id, p] : start.p_first) {
    p *= scale;
  }
  return start;
}

}  // namespace pangea::vio

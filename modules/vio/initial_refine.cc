// Bundle adjustment of the start-up window: reprojection and preintegrated IMU, one bias for all of
// it.

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <vector>

#include "common/preintegration.h"
#include "vio/initial_solution.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kGyroBiasPrior = 0.02;   // rad/s, about the epipolar solution
constexpr double kAccelBiasPrior = 0.15;  // m/s^2, about zero
constexpr double kHuberSigmas = 2.0;
constexpr double kInlierSigmas = 4.0;
constexpr double kMaxDistance = 200;  // m, of a point: beyond it the start's baseline says nothing
constexpr double kPointPrior = 10;    // times its distance, about the closed-form solution

template <typename T>
using Vec3 = Eigen::Matrix<T, 3, 1>;

// Whitened preintegration residual (Forster et al., eq. 37, with gravity added back), order
// (rotation, velocity, position).
struct ImuCost {
  ImuCost(const Preintegration& preintegration)
      : p(preintegration),
        sqrt_information(Eigen::Matrix<double, 9, 9>(p.covariance.llt().matrixL()).inverse()) {}

  template <typename T>
  bool operator()(const T* q_i, const T* p_i, const T* v_i, const T* q_j, const T* p_j,
                  const T* v_j, const T* bg, const T* ba, T* out) const {
    const Eigen::Map<const Eigen::Quaternion<T>> Qi(q_i), Qj(q_j);
    const Eigen::Map<const Vec3<T>> Pi(p_i), Pj(p_j), Vi(v_i), Vj(v_j), Bg(bg), Ba(ba);
    Eigen::Matrix<T, 6, 1> db;
    db << Bg - p.gyro_bias.cast<T>(), Ba - p.accel_bias.cast<T>();
    const Eigen::Matrix<T, 9, 1> d = p.bias_jacobian.cast<T>() * db;
    const Vec3<T> half = T(0.5) * d.template head<3>();
    const Eigen::Quaternion<T> dq =
        p.delta_q.cast<T>() * Eigen::Quaternion<T>(T(1), half.x(), half.y(), half.z()).normalized();
    const T dt(p.duration_s);
    const Vec3<T> g(T(0), T(0), T(-kGravity));
    Eigen::Matrix<T, 9, 1> r;
    const Eigen::Quaternion<T> error = dq.conjugate() * (Qi.conjugate() * Qj);
    r.template head<3>() = T(2) * (error.w() < T(0) ? T(-1) : T(1)) * error.vec();
    r.template segment<3>(3) =
        Qi.conjugate() * (Vj - Vi - g * dt) - (p.delta_v.cast<T>() + d.template segment<3>(3));
    r.template tail<3>() = Qi.conjugate() * (Pj - Pi - Vi * dt - T(0.5) * g * dt * dt) -
                           (p.delta_p.cast<T>() + d.template tail<3>());
    Eigen::Map<Eigen::Matrix<T, 9, 1>>{out} = sqrt_information.cast<T>() * r;
    return true;
  }

  Preintegration p;
  Eigen::Matrix<double, 9, 9> sqrt_information;
};

struct RayCost {
  Vector2d ray;
  Rigid3 T_body_cam;
  double sigma;

  template <typename T>
  bool operator()(const T* q, const T* t, const T* point, T* out) const {
    const Eigen::Map<const Eigen::Quaternion<T>> Q(q);
    const Eigen::Map<const Vec3<T>> P(t), X(point);
    const Vec3<T> y =
        T_body_cam.q.conjugate().cast<T>() * (Q.conjugate() * (X - P) - T_body_cam.t.cast<T>());
    if (y.z() < T(0.05)) {
      return false;
    }
    out[0] = (y.x() / y.z() - T(ray.x())) / T(sigma);
    out[1] = (y.y() / y.z() - T(ray.y())) / T(sigma);
    return true;
  }
};

struct PriorCost {
  Vector3d mean;
  double sigma;
  template <typename T>
  bool operator()(const T* x, T* out) const {
    for (int k = 0; k < 3; ++k) {
      out[k] = (x[k] - T(mean[k])) / T(sigma);
    }
    return true;
  }
};

// Holds the first pose's yaw: the rotation about odom z of its attitude against the start.
struct YawCost {
  Quaterniond start;
  template <typename T>
  bool operator()(const T* q, T* out) const {
    const Eigen::Map<const Eigen::Quaternion<T>> Q(q);
    const Eigen::Quaternion<T> turn = Q * start.conjugate().cast<T>();
    out[0] = T(2) * turn.z() / (turn.w() * T(1e-4));
    return true;
  }
};

// Views of the unknowns, which all live in one array: Ceres orders blocks by their address, and
// only inside one array is that the same in every run.
struct Pose {
  Eigen::Map<Quaterniond> q;
  Eigen::Map<Vector3d> p, v;
};

class StartProblem {
 public:
  StartProblem(std::span<const StartFrame> frames, const Rigid3& T_body_cam, const ImuNoise& noise,
               const Vector3d& gyro_bias, const LinearStart& start, double ray_sigma)
      : frames_(frames), T_body_cam_(T_body_cam), ray_sigma_(ray_sigma) {
    blocks_.reserve(2 + 3 * frames.size() + start.p_first.size());
    new (&gyro_bias_) Eigen::Map<Vector3d>(NewBlock(gyro_bias));
    new (&accel_bias_) Eigen::Map<Vector3d>(NewBlock(Vector3d::Zero()));
    const Quaterniond q_odom_first = Quaterniond::FromTwoVectors(-start.gravity, Vector3d::UnitZ());
    for (size_t k = 0; k < frames.size(); ++k) {
      double* q = NewBlock((q_odom_first * start.T_first_body[k].q).coeffs());
      double* p = NewBlock(q_odom_first * start.T_first_body[k].t);
      double* v = NewBlock(q_odom_first * start.v_first_body[k]);
      poses_.push_back(
          {Eigen::Map<Quaterniond>(q), Eigen::Map<Vector3d>(p), Eigen::Map<Vector3d>(v)});
    }
    for (const auto& [id, p] : start.p_first) {
      if (p.norm() < kMaxDistance) {
        points_.emplace(id, Eigen::Map<Vector3d>(NewBlock(q_odom_first * p)));
      }
    }
    AddImu(noise);
    AddRays();
    HoldPoints();
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PriorCost, 3, 3>(new PriorCost{gyro_bias, kGyroBiasPrior}),
        nullptr, gyro_bias_.data());
    problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<PriorCost, 3, 3>(
                                  new PriorCost{Vector3d::Zero(), kAccelBiasPrior}),
                              nullptr, accel_bias_.data());
    problem_.AddResidualBlock(
        new ceres::AutoDiffCostFunction<YawCost, 1, 4>(new YawCost{poses_[0].q}), nullptr,
        poses_[0].q.coeffs().data());
    problem_.SetParameterBlockConstant(poses_[0].p.data());
  }

  std::optional<RefinedStart> Solve() {
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = Ordering();
    // The closed form is too small where noise is large beside the motion's changes, and scale is a
    // long flat valley: fewer iterations end half way up it, where the covariance is smaller.
    options.max_num_iterations = 100;
    options.function_tolerance = 1e-8;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    if (!summary.IsSolutionUsable()) {
      return std::nullopt;
    }
    RefinedStart out;
    Residuals(&out);
    if (!Covariance(&out)) {
      return std::nullopt;
    }
    for (const Pose& pose : poses_) {
      out.states.push_back({{pose.q.normalized(), pose.p - poses_.back().p},
                            Vector3d(pose.v),
                            Vector3d(gyro_bias_),
                            Vector3d(accel_bias_)});
    }
    return out;
  }

 private:
  template <typename Vector>
  double* NewBlock(const Vector& value) {
    blocks_.emplace_back(Eigen::Vector4d::Zero());
    blocks_.back().head(value.size()) = value;
    return blocks_.back().data();
  }

  // Points are eliminated first.
  std::shared_ptr<ceres::ParameterBlockOrdering> Ordering() const {
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    std::vector<double*> all;
    problem_.GetParameterBlocks(&all);
    for (double* block : all) {
      ordering->AddElementToGroup(block, 1);
    }
    for (const auto& [id, point] : points_) {
      if (problem_.HasParameterBlock(point.data())) {
        ordering->AddElementToGroup(const_cast<double*>(point.data()), 0);
      }
    }
    return ordering;
  }

  void AddImu(const ImuNoise& noise) {
    for (size_t k = 1; k < frames_.size(); ++k) {
      Preintegrator integrator(noise, gyro_bias_, Vector3d::Zero());
      integrator.Add(frames_[k].imu);
      Preintegration p = integrator.result();
      // Keeps a span of a single sample invertible: positions to 1 micrometre.
      p.covariance.diagonal().array() += 1e-12;
      Pose& a = poses_[k - 1];
      Pose& b = poses_[k];
      problem_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<ImuCost, 9, 4, 3, 3, 4, 3, 3, 3, 3>(new ImuCost(p)),
          nullptr, a.q.coeffs().data(), a.p.data(), a.v.data(), b.q.coeffs().data(), b.p.data(),
          b.v.data(), gyro_bias_.data(), accel_bias_.data());
    }
    for (Pose& pose : poses_) {
      problem_.SetManifold(pose.q.coeffs().data(), new ceres::EigenQuaternionManifold);
    }
  }

  void AddRays() {
    for (size_t k = 0; k < frames_.size(); ++k) {
      for (const auto& [id, ray] : frames_[k].rays) {
        const auto point = points_.find(id);
        const Vector3d y =
            point == points_.end()
                ? Vector3d(0, 0, -1)
                : Vector3d((Rigid3(poses_[k].q, poses_[k].p) * T_body_cam_).Inverse() *
                           point->second);
        if (y.z() > 0.1) {
          problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<RayCost, 2, 4, 3, 3>(
                                        new RayCost{ray, T_body_cam_, ray_sigma_}),
                                    new ceres::HuberLoss(kHuberSigmas), poses_[k].q.coeffs().data(),
                                    poses_[k].p.data(), point->second.data());
        }
      }
    }
  }

  // A point straight ahead may be anywhere along its ray, and one such leaves all unknowns without
  // a covariance. So each is held, by next to nothing.
  void HoldPoints() {
    for (auto& [id, point] : points_) {
      if (problem_.HasParameterBlock(point.data())) {
        problem_.AddResidualBlock(new ceres::AutoDiffCostFunction<PriorCost, 3, 3>(
                                      new PriorCost{point, kPointPrior * (1 + point.norm())}),
                                  nullptr, point.data());
      }
    }
  }

  void Residuals(RefinedStart* out) const {
    double sum = 0;
    int inliers = 0, total = 0;
    for (size_t k = 0; k < frames_.size(); ++k) {
      const Rigid3 T_cam_odom = (Rigid3(poses_[k].q, poses_[k].p) * T_body_cam_).Inverse();
      for (const auto& [id, ray] : frames_[k].rays) {
        const auto point = points_.find(id);
        if (point == points_.end()) {
          continue;
        }
        ++total;
        const Vector3d y = T_cam_odom * point->second;
        const double r = y.z() > 0.05 ? (y.head<2>() / y.z() - ray).norm() / ray_sigma_ : 1e9;
        if (r < kInlierSigmas) {
          ++inliers;
          sum += r * r;
        }
      }
    }
    out->inlier_share = total > 0 ? static_cast<double>(inliers) / total : 0;
    out->rms_sigma = inliers > 0 ? std::sqrt(sum / (2.0 * inliers)) : 1e9;
  }

  bool Covariance(RefinedStart* out) {
    ceres::Covariance::Options options;
    options.algorithm_type = ceres::SPARSE_QR;
    options.num_threads = 1;
    ceres::Covariance covariance(options);
    Pose& last = poses_.back();
    const std::vector<const double*> blocks = {last.q.coeffs().data(), last.p.data(), last.v.data(),
                                               gyro_bias_.data(), accel_bias_.data()};
    if (!covariance.Compute(blocks, &problem_)) {
      return false;
    }
    Eigen::Matrix<double, 15, 15, Eigen::RowMajor> C;
    covariance.GetCovarianceMatrixInTangentSpace(blocks, C.data());
    // Ceres' quaternion tangent is half the angle, on the left.
    Eigen::Matrix<double, 15, 1> scale = Eigen::Matrix<double, 15, 1>::Ones();
    scale.head<3>().setConstant(2.0);
    out->covariance = scale.asDiagonal() * C * scale.asDiagonal();
    return out->covariance.allFinite();
  }

  std::span<const StartFrame> frames_;
  Rigid3 T_body_cam_;
  double ray_sigma_;
  std::vector<Eigen::Vector4d> blocks_;
  Eigen::Map<Vector3d> gyro_bias_{nullptr};
  Eigen::Map<Vector3d> accel_bias_{nullptr};
  std::vector<Pose> poses_;
  std::map<int32_t, Eigen::Map<Vector3d>> points_;
  ceres::Problem problem_;
};

}  // namespace

std::optional<RefinedStart> Refine(std::span<const StartFrame> frames, const Rigid3& T_body_cam,
                                   const ImuNoise& noise, const Vector3d& gyro_bias,
                                   const LinearStart& start, double ray_sigma) {
  return StartProblem(frames, T_body_cam, noise, gyro_bias, start, ray_sigma).Solve();
}

}  // namespace pangea::vio

// The alignment against landmarks of the map: derivatives, consistency, wrong associations.

#include "vio/live/window_localisation.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "vio/live/map_landmark_factor.h"

namespace pangea::vio {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double kRaySigma = 1.5 / 458;

// A window of poses along a line, a map of points before it, and errors drawn from what the
// alignment assumes of them.
class World {
 public:
  explicit World(uint64_t seed) : rng_(seed) {
    T_body_cam_.q = Eigen::Quaterniond(
        (Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished());  // looks along x
    T_body_cam_.t = {0.05, -0.02, 0.01};
    for (int i = 0; i < 8; ++i) {
      T_map_body_.push_back(
          {ExpSo3({0.05 * i, -0.02 * i, 0.04 * i}), {20 + 0.3 * i, 5 - 0.2 * i, 1 + 0.05 * i}});
    }
    for (const Vector3d& p : {Vector3d(19, 5, 1), Vector3d(20, 3, 1.5), Vector3d(21, 4, 0.5)}) {
      sources_.push_back(p);
    }
    prior_.covariance = 1e-4 * Matrix4d::Identity();
    prior_.covariance(3, 3) = 1e-5;
    prior_.covariance(0, 1) = prior_.covariance(1, 0) = 5e-5;
  }

  double Normal() { return normal_(rng_); }
  double Uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(rng_);
  }

  // The agent's estimate: its odometry drifts step by step, and the prior has an error at the first
  // pose.
  void MakeEstimate(const LocalizationOptions& options) {
    const Rigid3 T_map_odom{YawRotation(0.7), {3, -2, 0.5}};
    prior_.T_map_odom = T_map_odom;
    const Eigen::LLT<Eigen::Matrix4d> root(prior_.covariance);
    const Vector4d off = root.matrixL() * Vector4d(Normal(), Normal(), Normal(), Normal());
    Rigid3 T = T_map_body_.front();
    T = {(YawRotation(-off[3]) * T.q).normalized(), T.t - off.head<3>()};
    const int n = static_cast<int>(T_map_body_.size());
    // The errors of the steps are independent, and right-invariant in odom.
    Eigen::MatrixXd steps = Eigen::MatrixXd::Zero(6 * n, 6 * n);
    for (int i = 0; i < n; ++i) {
      Vector6d e = Vector6d::Zero();
      const double angle = i == 0 ? 0.001 : 0.0005, shift = i == 0 ? 0 : 0.002;
      for (int k = 0; k < 6; ++k) {
        const bool given_up = i == 0 && k >= 2;
        const double sigma = given_up ? 0.1 : k < 3 ? angle : shift;
        steps(6 * i + k, 6 * i + k) = sigma * sigma;
        e[k] = given_up ? 0 : sigma * Normal();
      }
      error_ += e;
      const Rigid3 T_odom_body =
          i == 0 ? T_map_odom.Inverse() * T
                 : T_map_odom.Inverse() * T * (T_map_body_.front().Inverse() * T_map_body_[i]);
      const Eigen::Quaterniond rotation = ExpSo3(-error_.head<3>());
      window_.utimes.push_back(i);
      window_.T_odom_body.push_back(
          {(rotation * T_odom_body.q).normalized(), rotation * (T_odom_body.t - error_.tail<3>())});
    }
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(6 * n, 6 * n);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) {
        sum.block<6, 6>(6 * i, 6 * j).setIdentity();
      }
    }
    window_.covariance = sum * steps * sum.transpose();
    for (size_t s = 0; s < sources_.size(); ++s) {
      const double p = options.source_position_sigma, y = options.source_yaw_sigma;
      source_errors_.emplace_back(p * Normal(), p * Normal(), p * Normal(), y * Normal());
    }
  }

  void SeeLandmarks(int count) {
    while (static_cast<int>(landmarks_.size()) < count) {
      SeenLandmark landmark;
      landmark.source = static_cast<int>(landmarks_.size() % sources_.size());
      const Vector3d truth(Uniform(25, 29), Uniform(1, 8), Uniform(-1, 4));
      const Vector3d c = sources_[landmark.source];
      const Vector4d& off = source_errors_[landmark.source];
      // truth = c + Rz(yaw) (p - c) + shift; the point has an error of its own, too.
      const Vector3d along = (truth - c).normalized();
      landmark.covariance = 1e-5 * Matrix3d::Identity() + 4e-4 * along * along.transpose();
      const Eigen::LLT<Matrix3d> root(landmark.covariance);
      landmark.p_map = c + YawRotation(-off[3]) * (truth - c - off.head<3>()) -
                       root.matrixL() * Vector3d(Normal(), Normal(), Normal());
      for (int i = 0; i < static_cast<int>(T_map_body_.size()); i += 2) {
        const Vector3d y = (T_map_body_[i] * T_body_cam_).Inverse() * truth;
        if (y.z() > 1 && y.hnormalized().norm() < 0.8) {
          landmark.rays.push_back(
              {i, y.hnormalized() + kRaySigma * Eigen::Vector2d(Normal(), Normal()), kRaySigma});
        }
      }
      if (!landmark.rays.empty()) {
        landmarks_.push_back(landmark);
      }
    }
  }

  std::optional<LocalizationResult> Localise(const LocalizationOptions& options) const {
    return LocalizeWindow(window_, T_body_cam_, prior_, sources_, landmarks_, options);
  }
  Vector4d ErrorOf(const Rigid3& T_map_odom) const {
    const Rigid3 T = T_map_odom * window_.T_odom_body.back();
    Vector4d e;
    e << T_map_body_.back().t - T.t, LogSo3(T_map_body_.back().q * T.q.conjugate()).z();
    return e;
  }

  using Matrix4d = Eigen::Matrix4d;
  std::mt19937_64 rng_;
  std::normal_distribution<double> normal_;
  Rigid3 T_body_cam_;
  std::vector<Rigid3> T_map_body_;
  std::vector<Vector3d> sources_;
  std::vector<Vector4d> source_errors_;
  LocalizationPrior prior_;
  WindowPoses window_;
  Vector6d error_ = Vector6d::Zero();
  std::vector<SeenLandmark> landmarks_;
};

TEST(WindowLocalisation, DerivativesAreThoseOfTheResidual) {
  World world(3);
  LocalizationOptions options;
  world.MakeEstimate(options);
  world.SeeLandmarks(20);
  const Vector3d origin = world.T_map_body_.back().t;
  std::vector<Rigid3> poses;
  for (const Rigid3& T : world.T_map_body_) {
    poses.push_back({T.q, T.t - origin});
  }
  constexpr double kStep = 1e-6;
  for (SeenLandmark landmark : world.landmarks_) {
    landmark.covariance.setZero();  // the whitening's own derivative is left out on purpose
    const Vector3d c = world.sources_[landmark.source] - origin;
    const Vector4d at(0.01, -0.02, 0.03, 0.01);
    const Whitened w = WhitenLandmark(poses, world.T_body_cam_, landmark, origin, c, at);
    ASSERT_GT(w.r.size(), 0);
    for (int k = 0; k < 4; ++k) {
      const Vector4d d = kStep * Vector4d::Unit(k);
      const Eigen::VectorXd numeric =
          (WhitenLandmark(poses, world.T_body_cam_, landmark, origin, c, at + d).r -
           WhitenLandmark(poses, world.T_body_cam_, landmark, origin, c, at - d).r) /
          (2 * kStep);
      EXPECT_LT((numeric - w.J_source.col(k)).norm(), 1e-4 * (1 + numeric.norm()));
    }
    for (size_t ray = 0; ray < landmark.rays.size(); ++ray) {
      for (int k = 0; k < 6; ++k) {
        const auto moved = [&](double step) {
          std::vector<Rigid3> out = poses;
          Rigid3& T = out[landmark.rays[ray].pose];
          const Vector6d e = step * Vector6d::Unit(k);
          const Eigen::Quaterniond rotation = ExpSo3(e.head<3>());
          T = {(rotation * T.q).normalized(), rotation * T.t + e.tail<3>()};
          return WhitenLandmark(out, world.T_body_cam_, landmark, origin, c, at).r;
        };
        const Eigen::VectorXd numeric = (moved(kStep) - moved(-kStep)) / (2 * kStep);
        EXPECT_LT((numeric - w.J_pose.col(6 * static_cast<int>(ray) + k)).norm(),
                  1e-4 * (1 + numeric.norm()));
      }
    }
  }
}

// Twelve correlated coordinates: the whitened norm is the Mahalanobis distance.
TEST(WindowLocalisation, TheLandmarksOwnErrorIsSharedByItsRays) {
  World world(5);
  world.MakeEstimate({});
  world.SeeLandmarks(5);
  const SeenLandmark& landmark = world.landmarks_.front();
  const std::vector<Rigid3>& poses = world.T_map_body_;
  const Vector3d c = world.sources_[landmark.source];
  const Whitened w =
      WhitenLandmark(poses, world.T_body_cam_, landmark, Vector3d::Zero(), c, Vector4d::Zero());
  const int n = static_cast<int>(w.r.size());
  const auto raw = [&](const Vector3d& p) {
    Eigen::VectorXd r(n);
    for (int i = 0; i < n / 2; ++i) {
      const Rigid3 T = (poses[landmark.rays[i].pose] * world.T_body_cam_).Inverse();
      r.segment<2>(2 * i) = (T * p).hnormalized() - landmark.rays[i].ray;
    }
    return r;
  };
  Eigen::MatrixXd J(n, 3);
  for (int k = 0; k < 3; ++k) {
    const Vector3d d = 1e-6 * Vector3d::Unit(k);
    J.col(k) = (raw(landmark.p_map + d) - raw(landmark.p_map - d)) / 2e-6;
  }
  const Eigen::MatrixXd S = kRaySigma * kRaySigma * Eigen::MatrixXd::Identity(n, n) +
                            J * landmark.covariance * J.transpose();
  const Eigen::VectorXd r = raw(landmark.p_map);
  EXPECT_NEAR(w.r.squaredNorm(), r.dot(S.ldlt().solve(r)), 1e-5 * (1 + w.r.squaredNorm()));
}

TEST(WindowLocalisation, IsAsGoodAsItsCovarianceSays) {
  constexpr int kRuns = 200;
  double nees = 0, before = 0, after = 0;
  int localised = 0;
  for (int run = 0; run < kRuns; ++run) {
    World world(100 + run);
    LocalizationOptions options;
    world.MakeEstimate(options);
    world.SeeLandmarks(40);
    const auto result = world.Localise(options);
    if (!result) {
      continue;
    }
    ++localised;
    const Vector4d e = world.ErrorOf(result->T_map_odom);
    nees += e.dot(result->covariance.ldlt().solve(e));
    before += world.ErrorOf(world.prior_.T_map_odom).head<3>().squaredNorm();
    after += e.head<3>().squaredNorm();
  }
  EXPECT_GE(localised, kRuns - 4);
  // 200 draws of chi-squared with four degrees of freedom: a mean of 4 +- 0.2.
  EXPECT_GT(nees / localised, 3.2);
  EXPECT_LT(nees / localised, 4.8);
  EXPECT_LT(after, 0.6 * before);
}

TEST(WindowLocalisation, WrongAssociationsAreLeftOut) {
  World world(7);
  LocalizationOptions options;
  world.MakeEstimate(options);
  world.SeeLandmarks(40);
  const auto clean = world.Localise(options);
  ASSERT_TRUE(clean);
  for (size_t i = 0; i < world.landmarks_.size(); i += 4) {
    for (SeenLandmark::Ray& ray : world.landmarks_[i].rays) {
      ray.ray += Eigen::Vector2d(12, -9) / 458;
    }
  }
  const auto result = world.Localise(options);
  ASSERT_TRUE(result);
  for (size_t i = 0; i < result->fits.size(); i += 4) {
    EXPECT_FALSE(result->fits[i]) << i;
  }
  const Vector3d moved = (result->T_map_odom * world.window_.T_odom_body.back()).t -
                         (clean->T_map_odom * world.window_.T_odom_body.back()).t;
  EXPECT_LT(moved.norm(), 0.01);
}

TEST(WindowLocalisation, LandmarksThatContradictTheCorrectionAreNotBelieved) {
  World world(8);
  LocalizationOptions options;
  world.MakeEstimate(options);
  world.SeeLandmarks(40);
  for (SeenLandmark& landmark : world.landmarks_) {
    landmark.p_map += Vector3d(0, 0.15, 0.1);  // all by the same step
  }
  EXPECT_FALSE(world.Localise(options));
}

TEST(WindowLocalisation, TooFewLandmarksSayNothing) {
  World world(9);
  LocalizationOptions options;
  world.MakeEstimate(options);
  world.SeeLandmarks(options.min_landmarks - 1);
  EXPECT_FALSE(world.Localise(options));
}

}  // namespace
}  // namespace pangea::vio

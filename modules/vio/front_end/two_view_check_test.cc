#include "vio/front_end/two_view_check.h"

#include <gtest/gtest.h>

#include <random>

#include "core/rigid3.h"

namespace pangea::vio {
namespace {

constexpr double kPixelAngle = 1.0 / 460;

struct TwoViews {
  std::vector<Eigen::Vector2d> a, b;
  std::vector<bool> good;
};

// 120 points at 2 to 10 m seen from two poses with 0.3 px noise; `wrong` of them are moved by 3 to
// 15 px in a random direction.
TwoViews MakeTwoViews(const Eigen::Quaterniond& q_b_a, const Eigen::Vector3d& t_b_a, int wrong,
                      uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> noise(0, 0.3 * kPixelAngle);
  TwoViews views;
  for (int i = 0; i < 120; ++i) {
    const double depth = 6 + 4 * uniform(random);
    const Eigen::Vector3d p_a(0.8 * uniform(random) * depth, 0.5 * uniform(random) * depth, depth);
    const Eigen::Vector3d p_b = q_b_a * p_a + t_b_a;
    Eigen::Vector2d b = p_b.hnormalized() + Eigen::Vector2d(noise(random), noise(random));
    if (i < wrong) {
      const double angle = 3.14159265 * uniform(random);
      b += kPixelAngle * (9 + 6 * uniform(random)) * Eigen::Vector2d(cos(angle), sin(angle));
    }
    views.a.push_back(p_a.hnormalized());
    views.b.push_back(b);
    views.good.push_back(i >= wrong);
  }
  return views;
}

struct Rates {
  double kept_good = 0;
  double kept_wrong = 0;
};

Rates RatesOf(const TwoViews& views, const TwoViewResult& result) {
  double good = 0, wrong = 0, kept_good = 0, kept_wrong = 0;
  for (size_t i = 0; i < views.good.size(); ++i) {
    (views.good[i] ? good : wrong) += 1;
    (views.good[i] ? kept_good : kept_wrong) += result.inlier[i] ? 1 : 0;
  }
  return {kept_good / good, wrong > 0 ? kept_wrong / wrong : 0};
}

const Eigen::Quaterniond kRotation = ExpSo3({0.02, -0.03, 0.05});
// The rotation by the gyro's bias in 50 ms, before the bias is estimated.
const Eigen::Quaterniond kBias = ExpSo3({0.001, 0.002, -0.004});

TEST(TwoViewCheck, SeparatesOutliersWhenMoving) {
  const TwoViews views = MakeTwoViews(kRotation, {0.1, 0.02, 0.05}, 36, 1);
  const Rates rates =
      RatesOf(views, CheckTwoView(views.a, views.b, kBias * kRotation, kPixelAngle, {}));
  EXPECT_GT(rates.kept_good, 0.95);
  // A third of the wrong tracks may move along the epipolar line, which two views cannot detect.
  EXPECT_LT(rates.kept_wrong, 0.35);
}

TEST(TwoViewCheck, KeepsEverythingGoodAtStandstill) {
  const TwoViews views = MakeTwoViews(Eigen::Quaterniond::Identity(), {0, 0, 0}, 20, 2);
  const Rates rates = RatesOf(
      views, CheckTwoView(views.a, views.b, Eigen::Quaterniond::Identity(), kPixelAngle, {}));
  EXPECT_GT(rates.kept_good, 0.97);
  EXPECT_LT(rates.kept_wrong, 0.4);
}

TEST(TwoViewCheck, KeepsEverythingGoodInPureRotation) {
  const TwoViews views = MakeTwoViews(kRotation, {0, 0, 0}, 0, 3);
  const TwoViewResult result = CheckTwoView(views.a, views.b, kBias * kRotation, kPixelAngle, {});
  EXPECT_GT(RatesOf(views, result).kept_good, 0.97);
  // The bias is detected: the rotation is the true one, not the gyro's.
  EXPECT_LT(result.q_b_a.angularDistance(kRotation), 3e-4);
}

TEST(TwoViewCheck, RejectsPointsThatRunBackwards) {
  TwoViews views = MakeTwoViews(Eigen::Quaterniond::Identity(), {0.15, 0, 0}, 0, 4);
  for (int i = 0; i < 20; ++i) {
    views.b[i] = views.a[i] - (views.b[i] - views.a[i]);
    views.good[i] = false;
  }
  const Rates rates = RatesOf(
      views, CheckTwoView(views.a, views.b, Eigen::Quaterniond::Identity(), kPixelAngle, {}));
  EXPECT_GT(rates.kept_good, 0.95);
  EXPECT_LT(rates.kept_wrong, 0.1);
}

TEST(TwoViewCheck, AHandfulOfTracksIsKept) {
  const TwoViews views = MakeTwoViews(kRotation, {0.1, 0, 0}, 0, 5);
  const std::vector<Eigen::Vector2d> a(views.a.begin(), views.a.begin() + 4);
  const std::vector<Eigen::Vector2d> b(views.b.begin(), views.b.begin() + 4);
  EXPECT_EQ(CheckTwoView(a, b, kRotation, kPixelAngle, {}).num_inliers, 4);
  EXPECT_EQ(CheckTwoView({}, {}, kRotation, kPixelAngle, {}).num_inliers, 0);
}

}  // namespace
}  // namespace pangea::vio

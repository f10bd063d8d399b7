#include "loop_verification/joint_ba/frame_information.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace pangea {
namespace {

using Eigen::MatrixXd;

constexpr int kSize = 13;  // two poses and a scale

// A weak prior, and landmarks with information in one direction each: some contribute little, some
// nearly all.
struct Information {
  MatrixXd total;
  std::vector<InformationShare> of_point;
  std::vector<JoinedPoints> landmarks;
};

Information RandomInformation(uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Information out;
  out.total = 0.3 * MatrixXd::Identity(kSize, kSize);
  for (int i = 0; i < 12; ++i) {
    out.landmarks.push_back({{}, true});
    const double size = 0.3 * std::exp(normal(random));
    for (int k = 0; k <= i % 3; ++k) {
      const MatrixXd J = MatrixXd::NullaryExpr(1, kSize, [&] { return size * normal(random); });
      out.landmarks.back().points.push_back(static_cast<int>(out.of_point.size()));
      out.of_point.push_back({J.transpose() * J, {0, 6, 12}});
      out.of_point.back().AddTo(1, &out.total);
    }
  }
  return out;
}

double PositionTrace(const Matrix6d& covariance) {
  return covariance.topLeftCorner<3, 3>().trace();
}

// Bounds skip some landmarks; the result is the same as with a solve without each landmark.
TEST(FrameInformation, WithoutOneIsTheWorstOfAll) {
  for (uint64_t seed = 1; seed <= 200; ++seed) {
    const Information information = RandomInformation(seed);
    double worst = 0;
    for (const JoinedPoints& landmark : information.landmarks) {
      MatrixXd rest = information.total;
      for (const int point : landmark.points) {
        information.of_point[point].AddTo(-1, &rest);
      }
      worst = std::max(worst, PositionTrace(*CovarianceOfFirst(rest)));
    }
    const auto without_one =
        CovarianceWithoutOne(information.total, information.of_point, information.landmarks);
    ASSERT_TRUE(without_one) << seed;
    EXPECT_NEAR(PositionTrace(*without_one) / worst, 1, 1e-9) << seed;
  }
}

TEST(FrameInformation, ALandmarkThatAloneFixesThePoseLeavesNothing) {
  Information information = RandomInformation(1);
  information.total.setZero();
  information.of_point[0].H = MatrixXd::Identity(kSize, kSize);
  information.of_point[0].AddTo(1, &information.total);
  EXPECT_FALSE(CovarianceWithoutOne(information.total, information.of_point, {{{0}, true}}));
}

}  // namespace
}  // namespace pangea

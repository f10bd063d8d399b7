#include "eval/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace pangea {
namespace {

class MetricsTest : public ::testing::Test {
 protected:
  Eigen::Vector3d Vector(double sigma) {
    std::normal_distribution<double> normal(0, sigma);
    return {normal(rng_), normal(rng_), normal(rng_)};
  }
  Rigid3 Transform() { return {ExpSo3(Vector(1.5)), Vector(20)}; }
  Rigid3 YawTransform() { return {YawRotation(Vector(2).x()), Vector(20)}; }

  // A curving path with rotating attitude, 20 Hz.
  static Trajectory Path(int count = 400) {
    Trajectory path;
    for (int i = 0; i < count; ++i) {
      const double s = 0.05 * i;
      path.push_back({1'000'000'000 + i * int64_t{50'000},
                      Rigid3(ExpSo3({0.3 * std::sin(s), 0.2 * std::cos(s), 0.5 * s}),
                             {3 * std::cos(0.4 * s), 2 * std::sin(0.7 * s), 0.3 * s})});
    }
    return path;
  }
  static Trajectory Moved(const Trajectory& path, double scale, const Rigid3& T) {
    Trajectory moved = path;
    for (StampedPose& pose : moved) {
      pose.T.t *= scale;
      pose.T = T * pose.T;
    }
    return moved;
  }
  Trajectory Noisy(const Trajectory& path, double sigma) {
    Trajectory noisy = path;
    for (StampedPose& pose : noisy) {
      pose.T.t += Vector(sigma);
    }
    return noisy;
  }
  std::mt19937_64 rng_{11};
};

TEST_F(MetricsTest, AnyRigidMoveIsRecoveredBySe3) {
  for (int i = 0; i < 50; ++i) {
    const Rigid3 T = Transform();
    const auto ate =
        AbsoluteError(Associate(Moved(Path(), 1, T), Path()), TrajectoryAlignmentKind::kSe3);
    ASSERT_TRUE(ate);
    EXPECT_LT(ate->position_m.max, 1e-9);
    EXPECT_LT(ate->rotation_rad.max, 1e-7);
    EXPECT_LT(ate->alignment.T_reference_estimate.Minus(T.Inverse()).norm(), 1e-7);
    EXPECT_EQ(ate->alignment.scale, 1.0);
    EXPECT_EQ(ate->position_m.count, 400U);
  }
}

TEST_F(MetricsTest, YawAlignmentRecoversYawAndNothingElse) {
  for (int i = 0; i < 50; ++i) {
    const auto yawed = AbsoluteError(Associate(Moved(Path(), 1, YawTransform()), Path()),
                                     TrajectoryAlignmentKind::kYaw);
    EXPECT_LT(yawed->position_m.max, 1e-9);
    const Rigid3 tilt(ExpSo3({0.1, 0, 0}), Eigen::Vector3d::Zero());
    const auto tilted = AbsoluteError(Associate(Moved(Path(), 1, tilt * YawTransform()), Path()),
                                      TrajectoryAlignmentKind::kYaw);
    EXPECT_GT(tilted->position_m.rmse, 0.05);
  }
}

TEST_F(MetricsTest, OnlySim3RecoversScale) {
  for (const double scale : {0.2, 0.97, 1.0, 5.0}) {
    const auto pairs = Associate(Moved(Path(), scale, Transform()), Path());
    const auto sim3 = AbsoluteError(pairs, TrajectoryAlignmentKind::kSim3);
    EXPECT_NEAR(sim3->alignment.scale, 1 / scale, 1e-9);
    EXPECT_LT(sim3->position_m.max, 1e-9);
    const auto se3 = AbsoluteError(pairs, TrajectoryAlignmentKind::kSe3);
    // Without scale the error is |1 - scale| times the points' spread about their mean.
    std::vector<Eigen::Vector3d> points;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const StampedPose& pose : Path()) {
      points.push_back(pose.T.t);
      mean += pose.T.t / 400;
    }
    double spread = 0;
    for (const Eigen::Vector3d& p : points) {
      spread += (p - mean).squaredNorm() / 400;
    }
    EXPECT_NEAR(se3->position_m.rmse, std::abs(1 - scale) * std::sqrt(spread), 1e-9);
  }
}

TEST_F(MetricsTest, AMirroredPathIsNotReflectedBack) {
  Trajectory mirrored = Path();
  for (StampedPose& pose : mirrored) {
    pose.T.t.x() = -pose.T.t.x();
  }
  const auto ate = AbsoluteError(Associate(mirrored, Path()), TrajectoryAlignmentKind::kSe3);
  EXPECT_NEAR(ate->alignment.T_reference_estimate.R().determinant(), 1.0, 1e-9);
  EXPECT_GT(ate->position_m.rmse, 0.1);
}

TEST_F(MetricsTest, NoiseLevelIsMeasured) {
  for (const double sigma : {0.001, 0.05, 0.5}) {
    const auto ate = AbsoluteError(Associate(Moved(Noisy(Path(), sigma), 1, Transform()), Path()),
                                   TrajectoryAlignmentKind::kSe3);
    // 400 points of 3 coordinates: 3 % is about 1.5 standard deviations of the estimate.
    EXPECT_NEAR(ate->position_m.rmse / (std::sqrt(3.0) * sigma), 1.0, 0.06);
  }
}

TEST_F(MetricsTest, EachAlignmentIsTheLeastSquaresOptimum) {
  const Trajectory estimate = Moved(Noisy(Path(), 0.2), 1.1, YawTransform());
  const auto pairs = Associate(estimate, Path());
  for (const TrajectoryAlignmentKind kind :
       {TrajectoryAlignmentKind::kSe3, TrajectoryAlignmentKind::kYaw,
        TrajectoryAlignmentKind::kSim3}) {
    const auto best = AbsoluteError(pairs, kind);
    for (int i = 0; i < 30; ++i) {
      TrajectoryAlignment other = best->alignment;
      Vector6d xi;
      xi << Vector(0.01), Vector(0.01);
      if (kind == TrajectoryAlignmentKind::kYaw) {
        xi(3) = xi(4) = 0;
      }
      other.T_reference_estimate = other.T_reference_estimate.Plus(xi);
      if (kind == TrajectoryAlignmentKind::kSim3) {
        other.scale *= 1 + Vector(0.01).x();
      }
      double sum = 0;
      for (const PosePair& pair : pairs) {
        sum += (other * pair.T_estimate_body.t - pair.T_reference_body.t).squaredNorm();
      }
      EXPECT_GT(std::sqrt(sum / static_cast<double>(pairs.size())), best->position_m.rmse);
    }
  }
}

TEST_F(MetricsTest, StandingStillHasAnErrorOfItsNoiseOnly) {
  Trajectory still;
  for (int i = 0; i < 100; ++i) {
    still.push_back({i * int64_t{50'000}, Rigid3()});
  }
  const auto ate =
      AbsoluteError(Associate(Noisy(still, 0.01), still), TrajectoryAlignmentKind::kSim3);
  ASSERT_TRUE(ate);
  EXPECT_LT(ate->position_m.rmse, 0.02);
  EXPECT_TRUE(std::isfinite(ate->rotation_rad.rmse));
}

TEST_F(MetricsTest, TooFewPairsHaveNoError) {
  EXPECT_FALSE(AbsoluteError(Associate(Path(2), Path()), TrajectoryAlignmentKind::kSe3));
  EXPECT_TRUE(AbsoluteError(Associate(Path(3), Path()), TrajectoryAlignmentKind::kSe3));
  EXPECT_FALSE(AbsoluteError({}, TrajectoryAlignmentKind::kSe3));
}

TEST_F(MetricsTest, AssociationSkipsHolesAndWhatIsOutside) {
  Trajectory reference = Path(100);
  reference.erase(reference.begin() + 40, reference.begin() + 60);
  Trajectory estimate;
  for (int i = -10; i < 110; ++i) {
    estimate.push_back({1'000'000'000 + i * int64_t{50'000} + 10'000, Rigid3()});
  }
  const auto pairs = Associate(estimate, reference);
  // The reference has 99 intervals; 21 of them are in the hole (39 to 60).
  EXPECT_EQ(pairs.size(), 99U - 21U);
  EXPECT_EQ(Associate(estimate, reference, 2'000'000).size(), 99U);
}

TEST_F(MetricsTest, JointErrorSeesTheTransformBetweenAgentsThatSingleErrorsHide) {
  const Rigid3 T = Transform();
  const Trajectory first = Moved(Path(), 1, T);
  // The second agent has an error of 0.1 m in the same map.
  const Trajectory second = Moved(Path(), 1, T * Rigid3({1, 0, 0, 0}, {0.1, 0, 0}));
  const auto a = Associate(first, Path());
  const auto b = Associate(second, Path());
  EXPECT_LT(AbsoluteError(b, TrajectoryAlignmentKind::kSe3)->position_m.rmse, 1e-9);
  const auto joint = JointAbsoluteError({a, b}, TrajectoryAlignmentKind::kSe3);
  ASSERT_TRUE(joint);
  EXPECT_NEAR(joint->position_m.rmse, 0.05, 1e-6);
  ASSERT_EQ(joint->agents.size(), 2U);
  EXPECT_EQ(joint->position_m.count, 800U);
  EXPECT_NEAR(joint->agents[0].position_m.rmse, 0.05, 1e-6);
  EXPECT_LT(JointAbsoluteError({a, a}, TrajectoryAlignmentKind::kSe3)->position_m.rmse, 1e-9);
}

TEST_F(MetricsTest, StatisticsByHand) {
  const Statistics s = StatisticsOf({3, 1, 2, 10});
  EXPECT_EQ(s.count, 4U);
  EXPECT_EQ(s.mean, 4);
  EXPECT_EQ(s.median, 2.5);
  EXPECT_EQ(s.max, 10);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(114.0 / 4));
  EXPECT_EQ(StatisticsOf({5, 1, 3}).median, 3);
  EXPECT_EQ(StatisticsOf({}).count, 0U);
}

TEST_F(MetricsTest, RelativeErrorIsBlindToTheFrameAndSeesScaleAndYawDrift) {
  Trajectory line;
  for (int i = 0; i <= 200; ++i) {
    line.push_back({i * int64_t{50'000}, Rigid3({1, 0, 0, 0}, {0.1 * i, 0, 0})});
  }
  const auto same = RelativeErrorOverDistance(Associate(Moved(line, 1, Transform()), line), 5);
  ASSERT_TRUE(same);
  EXPECT_LT(same->position_m.max, 1e-9);
  const auto scaled = RelativeErrorOverDistance(Associate(Moved(line, 1.02, Rigid3()), line), 4.99);
  EXPECT_NEAR(scaled->position_m.rmse, 0.1, 1e-9);
  EXPECT_EQ(scaled->position_m.count, 151U);
  Trajectory yawing = line;
  for (size_t i = 0; i < yawing.size(); ++i) {
    yawing[i].T.q = YawRotation(0.001 * static_cast<double>(i));
  }
  const auto rotated = RelativeErrorOverTime(Associate(yawing, line), 1.0);
  EXPECT_NEAR(rotated->rotation_rad.median, 0.02, 1e-9);
  EXPECT_FALSE(RelativeErrorOverDistance(Associate(line, line), 21));
  EXPECT_FALSE(RelativeErrorOverTime({}, 1));
}

// A pose every `step_s`, from `from_s` to `to_s`.
Trajectory Every(double step_s, double from_s, double to_s) {
  Trajectory poses;
  for (double s = from_s; s <= to_s + 1e-9; s += step_s) {
    poses.push_back({std::llround(1e6 * s), {}});
  }
  return poses;
}

TEST_F(MetricsTest, CoverageIsOfTheReferenceAfterItsFirstFiveSeconds) {
  const Trajectory reference = {{0, {}}, {25'000'000, {}}};
  EXPECT_DOUBLE_EQ(*Coverage(Every(0.5, 5, 25), reference), 1.0);
  EXPECT_DOUBLE_EQ(*Coverage(Every(5, 5, 25), reference), 1.0) << "stationary";
  EXPECT_DOUBLE_EQ(*Coverage(Every(0.5, 2, 14), reference), 0.5);
  EXPECT_DOUBLE_EQ(*Coverage({}, reference), 0);
  EXPECT_FALSE(Coverage({}, {}));
  EXPECT_FALSE(Coverage({}, {{0, {}}, {5'000'000, {}}}));
}

TEST_F(MetricsTest, CoverageIsAtMostOneAndSeesWhatIsMissing) {
  const Trajectory reference = {{0, {}}, {25'000'000, {}}};
  EXPECT_DOUBLE_EQ(*Coverage(Every(0.5, 0, 25), reference), 1.0) << "begins earlier";
  EXPECT_DOUBLE_EQ(*Coverage(Every(0.5, -40, 60), reference), 1.0) << "longer than the reference";
  EXPECT_DOUBLE_EQ(*Coverage(Every(0.5, 30, 60), reference), 0) << "after its end";
  EXPECT_DOUBLE_EQ(*Coverage(Every(0.5, -40, -20), reference), 0) << "before its beginning";
  Trajectory two_ends = Every(0.5, 0, 9);
  const Trajectory last = Every(0.5, 21, 25);
  two_ends.insert(two_ends.end(), last.begin(), last.end());
  EXPECT_DOUBLE_EQ(*Coverage(two_ends, reference), 0.5) << "half of it is missing";
  EXPECT_DOUBLE_EQ(*Coverage({{15'000'000, {}}}, reference), 0.1) << "one pose";
}

}  // namespace
}  // namespace pangea

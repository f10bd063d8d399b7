#include "calibration/epipolar.h"

#include <gtest/gtest.h>

#include "calibration/calibration_test_world.h"
#include "core/rigid3.h"

namespace pangea::calibration {
namespace {

TEST(Epipolar, NoResidualAtTheTruth) {
  const TestWorld world = MakeTestWorld({.seconds = 2, .pixel_sigma = 0, .exact_gyro = true});
  const int64_t origin = world.input.frames.front().utime;
  const auto pairs = MakePairs(world.input.frames, origin, kMaxGap_s);
  const OrientationCurve curve(world.input.imu, origin, world.truth.gyro_bias);
  ASSERT_GT(pairs.size(), 10U);
  for (const FramePair& pair : pairs) {
    const PairGeometry geometry(pair, Unprojected(pair, world.truth.camera), world.truth, curve, 1);
    const Eigen::VectorXd weights =
        Eigen::VectorXd::Ones(static_cast<Eigen::Index>(pair.points.size()));
    const Translation v = geometry.BestTranslation(weights, Translation::Zero());
    EXPECT_LT(geometry.Residuals(v).cwiseAbs().mean(), 0.02);
  }
}

// The Sampson distance of a displaced point is its distance from the epipolar line, shared by both
// images.
TEST(Epipolar, ResidualsArePixels) {
  TestWorld world = MakeTestWorld({.seconds = 2, .pixel_sigma = 0, .exact_gyro = true});
  world.truth.camera.distortion.setZero();
  const int64_t origin = world.input.frames.front().utime;
  std::vector<FramePair> pairs = MakePairs(world.input.frames, origin, kMaxGap_s);
  const OrientationCurve curve(world.input.imu, origin, world.truth.gyro_bias);
  FramePair& pair = pairs.front();
  const Eigen::VectorXd weights =
      Eigen::VectorXd::Ones(static_cast<Eigen::Index>(pair.points.size()));
  const PairGeometry before(pair, Unprojected(pair, world.truth.camera), world.truth, curve, 1);
  const Translation v = before.BestTranslation(weights, Translation::Zero());
  double squared = 0;
  for (const Eigen::Vector2d& step : {Eigen::Vector2d(1, 0), Eigen::Vector2d(0, 1)}) {
    FramePair moved = pair;
    for (PointPair& point : moved.points) {
      point.b += step;
    }
    const Eigen::VectorXd change =
        PairGeometry(moved, Unprojected(moved, world.truth.camera), world.truth, curve, 1)
            .Residuals(v) -
        before.Residuals(v);
    squared += change.squaredNorm() / static_cast<double>(change.size());
  }
  // One pixel in one image of two: 1/2 where both have the same line.
  EXPECT_NEAR(squared, 0.5, 0.1);
}

TEST(OrientationCurve, IntegratesAndKnowsItsGaps) {
  std::vector<ImuSample> imu;
  for (int i = 0; i <= 200; ++i) {
    if (i <= 100 || i >= 120) {
      imu.push_back({.utime = 5000 * i, .gyro = {0.1, 0, 0.5}});
    }
  }
  const OrientationCurve curve(imu, 0, {0.1, 0, 0});
  EXPECT_NEAR(LogSo3(curve.At(0.2).conjugate() * curve.At(0.4023)).z(), 0.5 * 0.2023, 1e-9);
  EXPECT_TRUE(curve.Covers(0.1, 0.49));
  EXPECT_FALSE(curve.Covers(0.45, 0.55));
  EXPECT_FALSE(curve.Covers(-0.1, 0.2));
  EXPECT_FALSE(curve.Covers(0.9, 1.1));
}

}  // namespace
}  // namespace pangea::calibration

#include "vio/imu/saturation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace pangea::vio {
namespace {

// How many samples of a shaken sensor are found, if its readings end at these values.
int Found(double gyro_range, double accel_range, int copies = 1) {
  SaturationDetector detector;
  int found = 0;
  for (int i = 0; i < 400; ++i) {
    const double t = 0.005 * i;
    ImuSample sample;
    sample.utime = 5000 * i;
    sample.gyro = Eigen::Vector3d(10 * std::sin(20 * t), std::cos(9 * t), std::sin(7 * t))
                      .cwiseMin(gyro_range)
                      .cwiseMax(-gyro_range);
    sample.accel = Eigen::Vector3d(std::cos(5 * t), 40 * std::sin(15 * t), 9.81 + std::cos(3 * t))
                       .cwiseMin(accel_range)
                       .cwiseMax(-accel_range);
    for (int copy = 0; copy < copies; ++copy) {
      found += detector.Add(sample) ? 1 : 0;
    }
  }
  return found;
}

TEST(SaturationDetector, FindsReadingsAtTheEndOfTheRange) {
  EXPECT_EQ(Found(100, 500), 0);
  EXPECT_GT(Found(250 * M_PI / 180, 500), 100);
  EXPECT_GT(Found(100, 2 * kGravity), 100);
  EXPECT_EQ(Found(100, 500, 4), 0) << "all axes are copied";
}

TEST(SaturationDetector, AStationarySensorIsWithinIt) {
  SaturationDetector detector;
  for (int i = 0; i < 100; ++i) {
    EXPECT_FALSE(detector.Add({5000 * i, {0, 0, 0.001 * (i % 2)}, {0, 0, 9.81}}));
  }
}

}  // namespace
}  // namespace pangea::vio

#include "phone/agent/camera_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace pangea::phone {
namespace {

using testing::HasSubstr;

constexpr const char* kImuYaml =
    R"(T_BS: {cols: 4, rows: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}
rate_hz: 60
gyroscope_noise_density: 3e-4
gyroscope_random_walk: 3e-5
accelerometer_noise_density: 5e-3
accelerometer_random_walk: 3e-3
)";
constexpr int64_t kImageStep_us = 100'000, kSampleStep_us = 20'000;

cv::Mat Detailed() {
  cv::Mat image(240, 320, CV_8U);
  cv::RNG rng(7);
  rng.fill(image, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(image, image, {9, 9}, 2);
  cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  return image;
}

// A phone that is held still before `image`.
CameraCalibration HeldStill(const cv::Mat& image, double seconds) {
  CameraCalibration calibration(image.cols, image.rows, kImuYaml, Eigen::Quaterniond::Identity());
  const auto end_us = static_cast<int64_t>(1e6 * seconds);
  for (int64_t t = -1'000'000; t < end_us + 1'000'000; t += kSampleStep_us) {
    calibration.AddImu({.utime = t, .accel = {0, 0, kGravity}});
  }
  for (int64_t t = 0; t < end_us; t += kImageStep_us) {
    calibration.AddImage(t, image);
  }
  return calibration;
}

TEST(CameraCalibration, BlankImagesLackPoints) {
  const CalibrationProgress progress =
      HeldStill(cv::Mat(240, 320, CV_8U, cv::Scalar(30)), 2).progress();
  EXPECT_EQ(progress.share, 0);
  EXPECT_EQ(progress.missing, "points");
}

TEST(CameraCalibration, WithoutRotationItNeverSuffices) {
  const CameraCalibration calibration = HeldStill(Detailed(), 25);
  EXPECT_EQ(calibration.progress().share, 0);
  EXPECT_EQ(calibration.progress().missing, "rotation about x");
  EXPECT_EQ(calibration.Solve().camera_yaml, "");
  EXPECT_THAT(calibration.Solve().refused, HasSubstr("rotate more"));
}

TEST(CameraCalibration, ForgetsWhatIsOlderThanItsWindow) {
  CameraCalibration calibration = HeldStill(Detailed(), 25);
  calibration.AddImage(CameraCalibration::kWindow_us + 30'000'000, Detailed());
  EXPECT_THAT(calibration.Solve().refused, HasSubstr("no images or no inertial samples"));
}

TEST(CameraCalibration, WhatIsWrongIsNamed) {
  try {
    CameraCalibration(640, 480, "rate_hz: 60", std::nullopt);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("imuYaml"));
  }
}

}  // namespace
}  // namespace pangea::phone

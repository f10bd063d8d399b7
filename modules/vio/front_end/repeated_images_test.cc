#include "vio/front_end/repeated_images.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "core/rigid3.h"
#include "vio/front_end/test_images.h"
#include "vio/front_end/tracker.h"

namespace pangea::vio {
namespace {

constexpr int64_t kImageStep_us = 16'667;    // a browser's
constexpr double kBiasError = 0.02 * 0.017;  // rad, of one step

Eigen::Quaterniond Yaw(double angle) { return ExpSo3(Eigen::Vector3d(0, angle, 0)); }

cv::Mat Compressed(const cv::Mat& image, int quality) {
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
}

cv::Mat WithNoise(const cv::Mat& image, uint64_t seed) {
  cv::Mat noise(image.size(), CV_16S), noisy;
  cv::RNG rng(seed);
  rng.fill(noise, cv::RNG::NORMAL, 0, 3);
  cv::add(image, noise, noisy, cv::noArray(), CV_8U);
  return noisy;
}

// A camera that has seen one image.
class RepeatedImagesTest : public ::testing::Test {
 protected:
  RepeatedImagesTest() { See(0, image_, Yaw(0)); }

  void See(int64_t utime, const cv::Mat& image, const Eigen::Quaterniond& q_cam_lastcam) {
    repeated_.NoteNew(image, tracker_.Track(utime, image, q_cam_lastcam));
  }

  const CameraModel camera_ = PlainCamera();
  const cv::Mat image_ = RandomTexture(camera_.width, camera_.height, 1);
  Tracker tracker_{camera_, {}};
  RepeatedImages repeated_{camera_};
};

TEST_F(RepeatedImagesTest, EqualPixelsRepeatWhateverTheGyroSays) {
  EXPECT_TRUE(repeated_.IsRepeat(kImageStep_us, image_.clone(), Yaw(0), kBiasError));
  EXPECT_TRUE(repeated_.IsRepeat(kImageStep_us, image_.clone(), Yaw(0.01), kBiasError));
}

TEST_F(RepeatedImagesTest, ACopyThatWasCompressedAnewRepeats) {
  See(kImageStep_us, Compressed(image_, 90), Yaw(0));
  for (const int quality : {85, 75, 60}) {
    EXPECT_TRUE(repeated_.IsRepeat(2 * kImageStep_us, Compressed(image_, quality), Yaw(0.003), 0))
        << quality;
  }
}

// The gyroscope measures nothing when the body only translates: then the features tell.
TEST_F(RepeatedImagesTest, ACopyBetweenMovingImagesRepeatsWithoutRotation) {
  const cv::Mat moved = RotatedView(image_, camera_, Yaw(0.004));
  See(kImageStep_us, Compressed(moved, 90), Yaw(0));
  EXPECT_TRUE(repeated_.IsRepeat(2 * kImageStep_us, Compressed(moved, 80), Yaw(0), kBiasError));
  EXPECT_FALSE(repeated_.IsRepeat(20 * kImageStep_us, Compressed(moved, 80), Yaw(0), kBiasError));
}

TEST_F(RepeatedImagesTest, AViewFromElsewhereIsNew) {
  for (const double angle : {0.0009, 0.002, 0.005, 0.02, 0.1}) {
    const cv::Mat view = RotatedView(image_, camera_, Yaw(angle));
    EXPECT_FALSE(repeated_.IsRepeat(kImageStep_us, view, Yaw(angle), kBiasError)) << angle;
    EXPECT_FALSE(repeated_.IsRepeat(kImageStep_us, WithNoise(view, 5), Yaw(angle), kBiasError));
  }
}

// Before the start the gyroscope's bias looks like rotation.
TEST_F(RepeatedImagesTest, AStillBodyIsNotMistakenForCopies) {
  constexpr double kBias = 0.1;  // rad/s
  See(kImageStep_us, WithNoise(image_, 1), Yaw(0));
  for (int i = 2; i < 20; ++i) {
    const double dt_s = 1e-6 * kImageStep_us;
    const cv::Mat noisy = WithNoise(image_, i);
    EXPECT_FALSE(
        repeated_.IsRepeat(i * kImageStep_us, noisy, Yaw(kBias * dt_s), 1.5 * kBias * dt_s));
    See(i * kImageStep_us, noisy, Yaw(kBias * dt_s));
  }
}

TEST_F(RepeatedImagesTest, AStillSceneWithoutNoiseIsSeenAgainNowAndThen) {
  EXPECT_TRUE(repeated_.IsRepeat(70'000, image_, Yaw(0), kBiasError));
  EXPECT_FALSE(repeated_.IsRepeat(100'000, image_, Yaw(0), kBiasError));
  EXPECT_TRUE(repeated_.IsRepeat(3'000'000, image_, Yaw(0.1), kBiasError)) << "a hanging camera";
}

TEST_F(RepeatedImagesTest, ABlankViewIsNoCopy) {
  const cv::Mat dark(image_.size(), CV_8U, cv::Scalar(0));
  tracker_.Reset();
  See(0, dark, Yaw(0));
  EXPECT_FALSE(repeated_.IsRepeat(kImageStep_us, dark, Yaw(0.01), kBiasError));
}

// In a vehicle that turns, only the gyroscope notices.
TEST_F(RepeatedImagesTest, AViewThatMovesWithTheCameraIsNewAfterHalfASecond) {
  const cv::Mat noisy = Compressed(image_, 80);
  EXPECT_TRUE(repeated_.IsRepeat(400'000, noisy, Yaw(0.1), kBiasError));
  EXPECT_FALSE(repeated_.IsRepeat(600'000, noisy, Yaw(0.15), kBiasError));
}

TEST_F(RepeatedImagesTest, TheFirstImageAndAnotherSizeAreNew) {
  repeated_.Reset();
  EXPECT_FALSE(repeated_.IsRepeat(kImageStep_us, image_, Yaw(0.01), kBiasError));
  See(kImageStep_us, image_, Yaw(0));
  EXPECT_FALSE(repeated_.IsRepeat(2 * kImageStep_us, cv::Mat(), Yaw(0.01), kBiasError));
}

}  // namespace
}  // namespace pangea::vio

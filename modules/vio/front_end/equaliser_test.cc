#include "vio/front_end/equaliser.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "vio/front_end/test_images.h"

namespace pangea::vio {
namespace {

// OpenCV blends the same tables in floating point; here weights are integers, in 128ths.
TEST(Equaliser, IsOpenCvsToTwoGreyLevels) {
  for (const double clip : {0.5, 3.0, 40.0}) {
    cv::Mat image = RandomTexture(752, 480, 1);
    image.colRange(0, 200).convertTo(image.colRange(0, 200), CV_8U, 0.2, 10);  // a dark side
    cv::Mat expected;
    cv::createCLAHE(clip, cv::Size(8, 8))->apply(image, expected);
    EXPECT_LE(cv::norm(Equaliser(clip).Apply(image), expected, cv::NORM_INF), 2) << clip;
  }
}

TEST(Equaliser, TakesSizesThatTilesDoNotDivide) {
  const cv::Mat image = RandomTexture(641, 363, 2);
  const cv::Mat out = Equaliser(3).Apply(image);
  EXPECT_EQ(out.size(), image.size());
  cv::Scalar mean, deviation, mean_before, deviation_before;
  cv::meanStdDev(out, mean, deviation);
  cv::meanStdDev(image, mean_before, deviation_before);
  EXPECT_GT(deviation[0], deviation_before[0]);
  // Neighbouring pixels of one grey value stay within a level: no seams between tiles.
  const cv::Mat ramp(363, 641, CV_8U, cv::Scalar(90));
  double low = 0, high = 0;
  cv::minMaxLoc(Equaliser(3).Apply(ramp), &low, &high);
  EXPECT_LE(high - low, 1);
}

}  // namespace
}  // namespace pangea::vio

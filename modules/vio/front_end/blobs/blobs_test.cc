#include "vio/front_end/blobs/blobs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>

#include "core/matching.h"
#include "vio/front_end/blobs/blob_descriptor.h"
#include "vio/front_end/spread.h"
#include "vio/front_end/test_images.h"

namespace pangea::vio {
namespace {

constexpr int kWanted = 200, kCell_px = 40;

cv::Mat ImageOfOneBlob(double x, double y, double sigma_px) {
  cv::Mat image(480, 640, CV_8U);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const double squared = (u - x) * (u - x) + (v - y) * (v - y);
      image.at<uchar>(v, u) =
          cv::saturate_cast<uchar>(60 + 120 * std::exp(-squared / (2 * sigma_px * sigma_px)));
    }
  }
  return image;
}

TEST(Blobs, AreWhereTheyAre) {
  for (const double sigma_px : {3.0, 6.0, 12.0}) {
    const double x = 300.3, y = 200.6;
    const auto blobs = DescribeBlobs(ImageOfOneBlob(x, y, sigma_px), 1, kCell_px);
    ASSERT_EQ(blobs.size(), 1u);
    EXPECT_NEAR(blobs[0].pixel.x(), x, 0.15) << sigma_px;
    EXPECT_NEAR(blobs[0].pixel.y(), y, 0.15) << sigma_px;
    EXPECT_EQ(blobs[0].landmark_id, kNoLandmark);
  }
}

// An octave in this project is a factor of 1.2.
TEST(Blobs, OctavesGrowWithTheSize) {
  const auto octave = [](double sigma_px) {
    return DescribeBlobs(ImageOfOneBlob(300, 200, sigma_px), 1, kCell_px)[0].octave;
  };
  EXPECT_NEAR(octave(20) - octave(10), std::log(2) / std::log(kOctaveScale), 1);
}

// A line has no definite position along itself.
TEST(Blobs, ALineIsNone) {
  cv::Mat image(480, 640, CV_8U);
  for (int u = 0; u < image.cols; ++u) {
    image.col(u).setTo(60 + 120 * std::exp(-0.02 * (u - 300) * (u - 300)));
  }
  EXPECT_TRUE(DescribeBlobs(image, kWanted, kCell_px).empty());
}

TEST(Blobs, AreSpreadOverTheImageAndNoMoreThanWanted) {
  const auto blobs = DescribeBlobs(RandomTexture(752, 480, 2), kWanted, kCell_px);
  EXPECT_LE(blobs.size(), static_cast<size_t>(kWanted));
  std::array<int, 4> part{};
  for (const Corner& blob : blobs) {
    ++part[(blob.pixel.x() > 376 ? 1 : 0) + (blob.pixel.y() > 240 ? 2 : 0)];
  }
  EXPECT_GT(*std::ranges::min_element(part), kWanted / 8);
  EXPECT_TRUE(DescribeBlobs(RandomTexture(752, 480, 2), 0, kCell_px).empty());
  EXPECT_TRUE(DescribeBlobs(cv::Mat(480, 752, CV_8U, cv::Scalar(80)), 9, kCell_px).empty());
}

TEST(SpreadOver, TakesTheStrongestOfEachCellFirst) {
  struct Item {
    cv::Point2f at;
    float response;
  };
  const std::vector<Item> items = {{{1, 1}, 3}, {{50, 1}, 1}, {{2, 2}, 5}, {{3, 3}, 4}};
  std::vector<float> responses;
  for (const Item& item : SpreadOver(items, &Item::at, kCell_px, 80, 3)) {
    responses.push_back(item.response);
  }
  EXPECT_EQ(responses, (std::vector<float>{5, 1, 4}));
}

// Corners do not survive this: the camera is twice as far away, and rolled.
TEST(Blobs, AreFoundAgainFromTwiceAsFar) {
  const cv::Mat near = RandomTexture(752, 480, 5);
  cv::Mat far(480, 752, CV_8U, cv::Scalar(128));
  const cv::Matx23d far_from_near(0.45, -0.2, 200, 0.2, 0.45, 60);
  cv::warpAffine(near, far, far_from_near, far.size(), cv::INTER_AREA, cv::BORDER_TRANSPARENT);
  const auto blobs_near = DescribeBlobs(near, kWanted, kCell_px);
  const auto blobs_far = DescribeBlobs(far, kWanted, kCell_px);
  int right = 0, wrong = 0;
  for (const CornerMatch& match : MatchCorners(blobs_near, blobs_far, {})) {
    const Eigen::Vector2f& a = blobs_near[match.a].pixel;
    const cv::Vec2d expected = far_from_near * cv::Vec3d(a.x(), a.y(), 1);
    const Eigen::Vector2f error =
        blobs_far[match.b].pixel - Eigen::Vector2d(expected[0], expected[1]).cast<float>();
    ++(error.norm() < 2 ? right : wrong);
  }
  EXPECT_GT(right, 15);
  EXPECT_LT(wrong, right / 4);
}

// The share of bits that differ is the angle between the histograms over pi.
TEST(SignsOfProjections, KeepAngles) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  for (const double angle : {0.2, 0.6, 1.2}) {
    double bits = 0;
    constexpr int kRuns = 200;
    for (int run = 0; run < kRuns; ++run) {
      Eigen::VectorXf a(128), b(128);
      for (int i = 0; i < 128; ++i) {
        a[i] = normal(random);
        b[i] = normal(random);
      }
      a.array() -= a.mean();
      b.array() -= b.mean();
      a.normalize();
      b = (b - a.dot(b) * a).normalized();
      b = std::cos(angle) * a + std::sin(angle) * b;
      a *= 100;
      b *= 100;
      bits +=
          HammingDistance(SignsOfProjections({a.data(), 128}), SignsOfProjections({b.data(), 128}));
    }
    EXPECT_NEAR(bits / kRuns, kDescriptorBits * angle / std::numbers::pi, 4) << angle;
  }
}

}  // namespace
}  // namespace pangea::vio

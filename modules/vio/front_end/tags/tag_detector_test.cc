#include "vio/front_end/tags/tag_detector.h"

#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <random>

#include "tags/tag_pattern.h"

namespace pangea::vio {
namespace {

// The tag with its white border, `cell_px` pixels a cell of its 10 x 10.
cv::Mat Printed(int id, int cell_px) {
  const TagPattern pattern = PatternOf({TagFamily::k36h11, id});
  cv::Mat cells(pattern.cells, pattern.cells, CV_8U);
  for (int row = 0; row < pattern.cells; ++row) {
    for (int column = 0; column < pattern.cells; ++column) {
      cells.at<uint8_t>(row, column) = pattern.IsWhite(row, column) ? 255 : 0;
    }
  }
  cv::Mat printed;
  cv::resize(cells, printed, {}, cell_px, cell_px, cv::INTER_NEAREST);
  return printed;
}

constexpr int kCell = 40;

// Shows the printed tag in an image: `H` maps its pixels to those of the image.
void Show(const cv::Mat& printed, const cv::Matx33d& H, cv::Mat* image) {
  cv::Mat big_image(image->size() * 4, CV_8U, cv::Scalar(110));
  cv::Mat big_mask(big_image.size(), CV_8U, cv::Scalar(0));
  // Drawn four times as large, then shrunk: pixels are means. Centres of pixels are at 0.
  const cv::Matx33d up(4, 0, 1.5, 0, 4, 1.5, 0, 0, 1);
  cv::warpPerspective(printed, big_image, up * H, big_image.size(), cv::INTER_LINEAR,
                      cv::BORDER_TRANSPARENT);
  cv::warpPerspective(cv::Mat(printed.size(), CV_8U, cv::Scalar(255)), big_mask, up * H,
                      big_image.size(), cv::INTER_NEAREST);
  cv::Mat shown, mask;
  cv::resize(big_image, shown, image->size(), 0, 0, cv::INTER_AREA);
  cv::resize(big_mask, mask, image->size(), 0, 0, cv::INTER_AREA);
  shown.copyTo(*image, mask > 0);
}

// A square of `side_px` pixels with its centre at (x, y), seen at an angle.
cv::Matx33d View(double x, double y, double side_px) {
  const double scale = side_px / (8 * kCell);
  const cv::Matx33d centred(scale, 0, -5 * kCell * scale + 0.5 * scale, 0, scale,
                            -5 * kCell * scale + 0.5 * scale, 0, 0, 1);
  const cv::Matx33d oblique(1.02, 0.13, x, -0.09, 0.91, y, 5e-4, 3e-4, 1);
  return oblique * centred;
}

// Corner of the black square in the printed image, whose pixels have their centres at 0.
Eigen::Vector2d TrueCorner(int corner, const cv::Matx33d& H) {
  const auto& [sx, sy] = kTagCornerSigns[static_cast<size_t>(corner)];
  const cv::Vec3d p = H * cv::Vec3d((5 + 4 * sx) * kCell - 0.5, (5 + 4 * sy) * kCell - 0.5, 1);
  return {p[0] / p[2], p[1] / p[2]};
}

cv::Mat Noisy(const cv::Mat& image, double sigma) {
  std::mt19937_64 rng(1);
  std::normal_distribution<double> noise(0, sigma);
  cv::Mat noisy = image.clone();
  for (uint8_t& grey : cv::Mat_<uint8_t>(noisy)) {
    grey = cv::saturate_cast<uint8_t>(grey + noise(rng));
  }
  return noisy;
}

TEST(TagDetector, CornersAreWhereTheyAreShownInOrder) {
  for (const double side_px : {24, 60, 150}) {
    cv::Mat image(480, 752, CV_8U, cv::Scalar(110));
    const cv::Matx33d H = View(300.3, 200.7, side_px);
    Show(Printed(17, kCell), H, &image);
    const auto found = TagDetector().Detect(Noisy(image, 2));
    ASSERT_EQ(found.size(), 1u) << side_px;
    EXPECT_EQ(found[0].tag, (TagId{TagFamily::k36h11, 17}));
    for (int i = 0; i < kTagCorners; ++i) {
      EXPECT_LT((found[0].corners[i].cast<double>() - TrueCorner(i, H)).norm(), 0.25)
          << side_px << " px, corner " << i;
    }
  }
}

TEST(TagDetector, WhatIsThereTwiceOrTinyIsLeftOut) {
  cv::Mat image(480, 752, CV_8U, cv::Scalar(110));
  Show(Printed(3, kCell), View(120, 120, 60), &image);
  Show(Printed(4, kCell), View(320, 120, 60), &image);
  Show(Printed(4, kCell), View(320, 320, 60), &image);
  Show(Printed(5, kCell), View(600, 300, 14), &image);
  const auto found = TagDetector().Detect(image);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].tag.id, 3);
}

TEST(TagDetector, NoTagInNoise) {
  cv::Mat image(480, 752, CV_8U);
  cv::RNG rng(3);
  rng.fill(image, cv::RNG::UNIFORM, 0, 255);
  EXPECT_TRUE(TagDetector().Detect(image).empty());
}

}  // namespace
}  // namespace pangea::vio

#include "vio/front_end/reference_patch.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "vio/front_end/test_images.h"

namespace pangea::vio {
namespace {

constexpr int kWidth = 160, kHeight = 120;
const Eigen::Vector2f kAt(80.3F, 60.8F);

// A smooth texture that is computed, not resampled: waves of 12 to 60 px in all directions. The
// point at kAt appears at kAt + shift, deformed by A.
cv::Mat Waves(const Eigen::Matrix2f& a, const Eigen::Vector2f& shift) {
  const Eigen::Matrix2f a_inverse = a.inverse();
  cv::Mat image(kHeight, kWidth, CV_8U);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const Eigen::Vector2f seen(static_cast<float>(x), static_cast<float>(y));
      const Eigen::Vector2f p = a_inverse * (seen - kAt - shift);
      double value = 128;
      for (int wave = 0; wave < 12; ++wave) {
        const double rotation = 2.4 * wave;
        const double length_px = 12 + 4 * wave;
        value += 12 * std::sin(6.28318 / length_px *
                                   (std::cos(rotation) * p.x() + std::sin(rotation) * p.y()) +
                               wave * wave);
      }
      image.at<uchar>(y, x) = cv::saturate_cast<uchar>(value);
    }
  }
  return image;
}

const Eigen::Matrix2f kAsItWas = Eigen::Matrix2f::Identity();

Eigen::Matrix2f RotateAndStretch(float angle, float stretch) {
  Eigen::Matrix2f a;
  a << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  return stretch * a;
}

TEST(ReferencePatch, FindsItselfMovedRotatedStretchedAndDarker) {
  auto patch = ReferencePatch::Take(Waves(kAsItWas, {0, 0}), kAt);
  ASSERT_TRUE(patch);
  const Eigen::Vector2f shift(0.4F, -0.7F);
  cv::Mat seen;
  Waves(RotateAndStretch(0.05F, 1.06F), shift).convertTo(seen, CV_8U, 0.6, 12);
  const auto found = patch->Find(seen, kAt);
  ASSERT_TRUE(found);
  EXPECT_LT((*found - kAt - shift).norm(), 0.03);
}

// Each step is Gauss-Newton with the patch's own derivative: near the truth an image with a known
// small deformation must be found exactly, in each of the six directions.
TEST(ReferencePatch, EachDirectionOfItsDerivativeIsRight) {
  const cv::Mat image = Waves(kAsItWas, {0, 0});
  for (int direction = 0; direction < 6; ++direction) {
    for (const float sign : {-1.0F, 1.0F}) {
      Eigen::Vector2f shift = Eigen::Vector2f::Zero();
      Eigen::Matrix2f a = Eigen::Matrix2f::Identity();
      (direction < 2 ? shift[direction] : a(direction % 2, direction / 2 - 1)) +=
          sign * (direction < 2 ? 0.3F : 0.03F);
      auto patch = ReferencePatch::Take(image, kAt);
      ASSERT_TRUE(patch);
      const auto found = patch->Find(Waves(a, shift), kAt);
      ASSERT_TRUE(found) << "direction " << direction;
      EXPECT_LT((*found - kAt - shift).norm(), 0.02) << "direction " << direction;
    }
  }
}

TEST(ReferencePatch, FollowsASlowGrowthUntilItIsWornOut) {
  auto patch = ReferencePatch::Take(Waves(kAsItWas, {0, 0}), kAt);
  ASSERT_TRUE(patch);
  int images = 0;
  float stretch = 1;
  while (!patch->NeedsReplacement() && images < 60) {
    stretch *= 1.02F;
    const auto found = patch->Find(Waves(RotateAndStretch(0, stretch), {0, 0}), kAt);
    ASSERT_TRUE(found) << "stretched by " << stretch;
    EXPECT_LT((*found - kAt).norm(), 0.1) << "stretched by " << stretch;
    ++images;
  }
  EXPECT_NEAR(stretch, 1.7, 0.15);
}

TEST(ReferencePatch, DoesNotFindItselfElsewhere) {
  const cv::Mat image = RandomTexture(kWidth, kHeight, 24);
  auto patch = ReferencePatch::Take(image, kAt);
  ASSERT_TRUE(patch);
  EXPECT_FALSE(patch->Find(RandomTexture(kWidth, kHeight, 25), kAt)) << "another image";
  EXPECT_FALSE(patch->Find(image, kAt + Eigen::Vector2f(15, 0))) << "15 px away";
  EXPECT_FALSE(patch->Find(image, {4, 4})) << "across the border";
  EXPECT_TRUE(patch->Find(image, kAt));
}

TEST(ReferencePatch, IsNotTakenFromABlankImageOrAtTheBorder) {
  EXPECT_FALSE(ReferencePatch::Take(cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(90)), kAt));
  EXPECT_FALSE(ReferencePatch::Take(RandomTexture(kWidth, kHeight, 26), {5, 60}));
}

}  // namespace
}  // namespace pangea::vio

#pragma once

// How a feature looked when its track began, to find it again without drift.
//
// KLT from image to image matches each image with the one before, so its errors add up along a
// track. Here the patch of the first image is matched directly: its affine deformation and its
// change of brightness are followed, by inverse compositional alignment (Baker & Matthews, "Lucas-
// Kanade 20 years on", IJCV 2004) of patches normalised to mean zero and length one.

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>

namespace pangea::vio {

class ReferencePatch {
 public:
  // The patch around `pixel` of a grey image; empty if it does not lie in the image or is blank.
  static std::optional<ReferencePatch> Take(const cv::Mat& image, const Eigen::Vector2f& pixel);

  // Where the patch is in `image`, near `guess`; empty if it does not look like itself there. The
  // deformation found is the next call's first guess.
  std::optional<Eigen::Vector2f> Find(const cv::Mat& image, const Eigen::Vector2f& guess);

  // The deformation has become so strong that what is sampled is not what was taken.
  bool NeedsReplacement() const;

 private:
  static constexpr int kSize = 19;  // pixels
  static constexpr int kCount = kSize * kSize;
  static constexpr float kHalf = (kSize - 1) / 2.0F;
  using Values = Eigen::Matrix<float, kCount, 1>;
  using Jacobian = Eigen::Matrix<float, kCount, 6>;

  // Takes mean and length out; returns the length, 0 if there is nothing but noise.
  static float Normalise(Values* values);

  Values look_;                      // normalised
  Jacobian jacobian_;                // of look_ by (x, y, a11, a21, a12, a22)
  Eigen::Matrix<float, 6, 6> gain_;  // inverse of its stiffened normal matrix
  // Takes directions in the patch to those in the newest image.
  Eigen::Matrix2f a_ = Eigen::Matrix2f::Identity();
};

}  // namespace pangea::vio

#pragma once

// The image patch of a feature at the start of its track, used to find the feature without drift.
//
// KLT matches each image with the previous one, so its errors accumulate along a track. Here the
// patch of the first image is matched directly, with an affine deformation and a change of
// brightness, by inverse compositional alignment (Baker & Matthews, "Lucas-Kanade 20 years on",
// IJCV 2004) of patches normalised to mean zero and length one.

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>

namespace pangea::vio {

class ReferencePatch {
 public:
  // The patch around `pixel` of a grey image; empty if it is not inside the image or has no
  // texture.
  static std::optional<ReferencePatch> Take(const cv::Mat& image, const Eigen::Vector2f& pixel);

  // Position of the patch in `image`, near `guess`; empty if the patch does not match there. The
  // deformation found is the initial guess of the next call.
  std::optional<Eigen::Vector2f> Find(const cv::Mat& image, const Eigen::Vector2f& guess);

  // True if the deformation is too strong for the patch to be resampled faithfully.
  bool NeedsReplacement() const;

 private:
  static constexpr int kSize = 19;  // pixels
  static constexpr int kCount = kSize * kSize;
  static constexpr float kHalf = (kSize - 1) / 2.0F;
  using Values = Eigen::Matrix<float, kCount, 1>;
  using Jacobian = Eigen::Matrix<float, kCount, 6>;

  // Normalises to mean zero and length one; returns the former length, or 0 if there is only noise.
  static float Normalise(Values* values);

  Values look_;                      // normalised
  Jacobian jacobian_;                // d(look_)/d(x, y, a11, a21, a12, a22)
  Eigen::Matrix<float, 6, 6> gain_;  // inverse of its regularised J^T J
  // Maps offsets in the patch to offsets in the newest image.
  Eigen::Matrix2f a_ = Eigen::Matrix2f::Identity();
};

}  // namespace pangea::vio

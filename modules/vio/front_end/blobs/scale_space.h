#pragma once

// Blobs of an image: extrema of differences of Gaussians over place and scale (Lowe, IJCV 2004,
// sections 3 and 4), with cheaper settings for real time: two layers per octave instead of three,
// kernels cut off at three sigmas, and no iterative search for the pixel nearest to an extremum
// (docs/decisions/real_revisits.md).

#include <opencv2/core.hpp>
#include <vector>

namespace pangea::vio {

struct Blob {
  cv::Point2f pixel;   // (0, 0) is the middle of the top-left pixel
  float sigma_px = 0;  // of the Gaussian; the blob's radius is sqrt(2) * sigma_px
  float response = 0;  // of the difference of Gaussians, grey levels in 0 .. 1
  int level = 0;       // nearest level of the scale space
};

class ScaleSpace {
 public:
  // `image`: 8-bit grey.
  explicit ScaleSpace(const cv::Mat& image);

  // In the order of octaves, the finest first.
  const std::vector<Blob>& blobs() const { return blobs_; }

  // The smoothed image of the level at which a blob was found (float, 0 .. 1), and the width of its
  // pixels in pixels of the original image.
  const cv::Mat& Level(const Blob& blob) const { return levels_[blob.level]; }
  float PixelWidth(const Blob& blob) const;

 private:
  std::vector<Blob> blobs_;
  std::vector<cv::Mat> levels_;  // only levels with blobs
};

}  // namespace pangea::vio

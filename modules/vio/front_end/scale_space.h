#pragma once

// Blobs of an image: extrema of differences of Gaussians over place and scale (Lowe, IJCV 2004,
// sections 3 and 4), for a keyframe's budget: two layers an octave in place of three, kernels that
// end at three sigmas, and no search for the pixel next to which the extremum lies
// (docs/decisions/real_revisits.md).

#include <opencv2/core.hpp>
#include <vector>

namespace pangea::vio {

struct Blob {
  cv::Point2f pixel;   // (0, 0) is the middle of the top-left pixel
  float sigma_px = 0;  // of the Gaussian; a blob's radius is sqrt(2) of it
  float response = 0;  // of the difference of Gaussians, of grey levels from 0 to 1
  int level = 0;       // of the scale space, the nearest
};

class ScaleSpace {
 public:
  // Of an 8-bit image.
  explicit ScaleSpace(const cv::Mat& image);

  // From the finest octave on.
  const std::vector<Blob>& blobs() const { return blobs_; }

  // The smoothed image where a blob was found, of floats from 0 to 1, and how many pixels of the
  // image each of its own is wide.
  const cv::Mat& Level(const Blob& blob) const { return levels_[blob.level]; }
  float PixelWidth(const Blob& blob) const;

 private:
  std::vector<Blob> blobs_;
  std::vector<cv::Mat> levels_;  // only those of blobs
};

}  // namespace pangea::vio

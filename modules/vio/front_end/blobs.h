#pragma once

// Blobs of an image, for recognising a place from another distance and side: extrema of differences
// of Gaussians, described by histograms of gradients (SIFT: Lowe, IJCV 2004) of which 256 bits are
// kept. Corners repeat between near views, blobs between far ones too
// (docs/decisions/real_revisits.md).
//
// The bits are signs of random projections, which keep angles between vectors (Charikar, STOC
// 2002): two rounds of random signs and a Hadamard transform, 128 bits, and two others for the
// other 128 (Ailon and Chazelle, STOC 2006).

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <span>
#include <vector>

#include "core/keyframe.h"

namespace pangea::vio {

class BlobDescriber {
 public:
  BlobDescriber();

  // At most `wanted` of them, spread over the image by cells of `cell_px`, strongest first; none
  // is a landmark. Looks at every second pixel: smaller blobs are seen from one distance only.
  std::vector<Corner> Describe(const cv::Mat& image, int wanted, int cell_px) const;

 private:
  cv::Ptr<cv::SIFT> sift_;
};

// Of a histogram of 128 bins.
Descriptor SignsOfProjections(std::span<const float> histogram);

}  // namespace pangea::vio

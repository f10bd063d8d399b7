#pragma once

// Blobs complement corners when a place is recognised from another distance or direction: corners
// repeat between near views, blobs also between distant ones (docs/decisions/real_revisits.md).

#include <opencv2/core.hpp>
#include <vector>

#include "core/keyframe.h"

namespace pangea::vio {

// Returns at most `wanted` blobs as corners with descriptor and without landmark_id, spread over
// the image by cells of `cell_px`, the strongest first. The descriptor is that of
// blob_descriptor.h.
std::vector<Corner> DescribeBlobs(const cv::Mat& image, int wanted, int cell_px);

// The same without descriptors: each blob's pixel, octave, and sigma in pixels.
struct FoundBlob {
  Corner corner;
  double sigma_px = 0;
};
std::vector<FoundBlob> FindBlobs(const cv::Mat& image, int wanted, int cell_px);

}  // namespace pangea::vio

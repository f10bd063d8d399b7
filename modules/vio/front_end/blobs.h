#pragma once

// Blobs beside corners, for recognising a place from another distance and side: corners repeat
// between near views, blobs between far ones too (docs/decisions/real_revisits.md).

#include <opencv2/core.hpp>
#include <vector>

#include "core/keyframe.h"

namespace pangea::vio {

// At most `wanted` of them, spread over the image by cells of `cell_px`, strongest first; none is a
// landmark.
std::vector<Corner> DescribeBlobs(const cv::Mat& image, int wanted, int cell_px);

}  // namespace pangea::vio

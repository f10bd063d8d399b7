#pragma once

// Shi and Tomasi's corners in a part of an image.

#include <opencv2/core.hpp>
#include <utility>
#include <vector>

namespace pangea::vio {

// The first is its response: the smaller eigenvalue, in the units of cv::cornerMinEigenVal.
using RatedCorner = std::pair<float, cv::Point>;

// The local maxima of the response in `cell`, from `least` on, row by row. `derivatives`: those of
// level 0 of cv::buildOpticalFlowPyramid, a view into a larger image with a border, so that the
// blocks see the true neighbourhood of the cell.
std::vector<RatedCorner> FindCorners(const cv::Mat& derivatives, const cv::Rect& cell, float least);

}  // namespace pangea::vio

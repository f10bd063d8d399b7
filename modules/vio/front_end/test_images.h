#pragma once

// Images for tests of the front end: a textured plane at infinity, seen by a rotating camera.

#include <cstdint>
#include <opencv2/core.hpp>

#include "core/camera_model.h"

namespace pangea::vio {

// Multi-scale random texture.
cv::Mat RandomTexture(int width, int height, uint64_t seed);

// 752 x 480 without distortion.
CameraModel PlainCamera();

// The image after the camera rotated, if it was `image` before: directions d_after = q * d_before.
cv::Mat RotatedView(const cv::Mat& image, const CameraModel& camera, const Eigen::Quaterniond& q);

}  // namespace pangea::vio

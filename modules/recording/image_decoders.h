#pragma once

// Decodes PNG and JPEG to 8-bit grey with libpng and libjpeg. The pixels are the same as those of
// cv::imread, but OpenCV's imgcodecs would make each odometry load 40 MB of other libraries.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>

namespace pangea {

// `size`: the size in the header. Empty when the image cannot be decoded. Colour becomes grey, and
// of 16 bits the upper 8 are kept. A JPEG's orientation tag is ignored, because the calibration is
// for the rows as they were read out.
cv::Mat DecodePng(std::span<const uint8_t> bytes, cv::Size size);
cv::Mat DecodeJpeg(std::span<const uint8_t> bytes, cv::Size size);

}  // namespace pangea

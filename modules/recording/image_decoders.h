#pragma once

// PNG and JPEG to 8-bit grey, by libpng and libjpeg: OpenCV's imgcodecs would do the same through
// 40 MB of other libraries, which each odometry would load. Same pixels as cv::imread's.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>

namespace pangea {

// Of the size that the header says; empty when it cannot be decoded. Colour becomes grey, of 16
// bits the upper 8 stay. The rotation that a camera wrote into a JPEG is left out: the calibration
// is of the rows as they were read out.
cv::Mat DecodePng(std::span<const uint8_t> bytes, cv::Size size);
cv::Mat DecodeJpeg(std::span<const uint8_t> bytes, cv::Size size);

}  // namespace pangea

#pragma once

// Images that come from outside, PNG or JPEG, as 8-bit grey. Nothing in one is trusted: the size
// that its header says is compared with the calibration's before a pixel is decoded, so that what
// an image may cost is known, and whatever a decoder finds wrong is a reason like any other.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

namespace pangea {

// What the header alone says.
struct ImageHeader {
  std::string format;  // "PNG", "JPEG", "BMP", ...; empty: none that is known
  cv::Size size;       // of a PNG or JPEG; 0x0: it does not say
};
ImageHeader ReadImageHeader(std::span<const uint8_t> bytes);

struct GreyImage {
  cv::Mat pixels;   // empty when it could not be decoded
  std::string why;  // then: the reason
  cv::Size size;    // what the header says, also of one that is refused for it
};

// `expected`: the calibration's size, pixels.
GreyImage DecodeGrey(std::span<const uint8_t> bytes, cv::Size expected);
// The same of a file, and no exception either when it cannot be read.
GreyImage ReadGrey(const std::string& path, cv::Size expected);

}  // namespace pangea

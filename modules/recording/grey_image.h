#pragma once

// Decodes PNG and JPEG images from outside to 8-bit grey. They are not trusted: the size in the
// header is compared with the calibration's before any pixel is decoded, which bounds memory and
// time. An error of a decoder is returned as a reason, like any other fault.

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

namespace pangea {

// The content of an image's header.
struct ImageHeader {
  std::string format;  // "PNG", "JPEG", "BMP", ...; empty: unknown
  cv::Size size;       // only of a PNG or JPEG; 0x0: unknown
};
ImageHeader ReadImageHeader(std::span<const uint8_t> bytes);

struct GreyImage {
  cv::Mat pixels;   // empty when it could not be decoded
  std::string why;  // the reason when `pixels` is empty
  cv::Size size;    // the size in the header, also when it is the reason
};

// `expected`: the calibration's size, pixels.
GreyImage DecodeGrey(std::span<const uint8_t> bytes, cv::Size expected);
// The same for a file. If it cannot be read, this is a reason too, and not an exception.
GreyImage ReadGrey(const std::string& path, cv::Size expected);

}  // namespace pangea

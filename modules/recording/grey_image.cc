#include "recording/grey_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <climits>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "files/text_file.h"
#include "recording/image_decoders.h"

namespace pangea {
namespace {

struct Signature {
  std::string_view format;
  std::string_view begins;
};
constexpr std::string_view kPng{"\x89PNG\r\n\x1a\n", 8};
constexpr std::string_view kJpeg{"\xff\xd8\xff", 3};
// Other formats that OpenCV would open, whatever the file's name is.
constexpr std::array kOthers = {Signature{"BMP", "BM"},
                                Signature{"GIF", "GIF8"},
                                Signature{"TIFF", {"II*\0", 4}},
                                Signature{"TIFF", {"MM\0*", 4}},
                                Signature{"Radiance HDR", "#?"},
                                Signature{"WebP", "RIFF"},
                                Signature{"PFM", "PF"},
                                Signature{"PFM", "Pf"},
                                Signature{"EXR", "\x76\x2f\x31"},
                                Signature{"JPEG 2000", {"\0\0\0\x0cjP", 6}},
                                Signature{"JPEG 2000", "\xff\x4f"},
                                Signature{"Sun raster", "\x59\xa6\x6a\x95"}};

uint32_t BigEndian(std::span<const uint8_t> bytes) {
  uint32_t value = 0;
  for (const uint8_t byte : bytes) {
    value = value << 8 | byte;
  }
  return value;
}

cv::Size SizeOf(uint32_t width, uint32_t height) {
  const bool fits = width <= INT_MAX && height <= INT_MAX;
  return fits ? cv::Size(static_cast<int>(width), static_cast<int>(height)) : cv::Size();
}

// A PNG begins with signature, length and name of the first chunk, width, height: RFC 2083,
// sections 3.1 and 4.1.1.
cv::Size PngSize(std::span<const uint8_t> bytes) {
  const bool whole = bytes.size() >= 24 && BigEndian(bytes.subspan(12, 4)) == 0x49484452;  // IHDR
  return whole ? SizeOf(BigEndian(bytes.subspan(16, 4)), BigEndian(bytes.subspan(20, 4)))
               : cv::Size();
}

// Whether the marker begins a frame: ITU-T T.81, table B.1. C4, C8 and CC do not.
bool BeginsFrame(uint8_t marker) {
  return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

// Goes from segment to segment, each with its length after its marker, to the one that begins a
// frame.
cv::Size JpegSize(std::span<const uint8_t> bytes) {
  for (size_t at = 2; at + 9 <= bytes.size() && bytes[at] == 0xff;) {
    const uint8_t marker = bytes[at + 1];
    if (BeginsFrame(marker)) {
      return SizeOf(BigEndian(bytes.subspan(at + 7, 2)), BigEndian(bytes.subspan(at + 5, 2)));
    }
    at += marker == 0xff ? 1 : 2 + BigEndian(bytes.subspan(at + 2, 2));  // ff: a fill byte
  }
  return {};
}

// PBM, PGM, PPM and PAM begin with P and a digit.
bool IsNetpbm(std::string_view text) {
  return text.size() > 2 && text[0] == 'P' && text[1] >= '1' && text[1] <= '7';
}

// Largest plausible file: uncompressed, with 16 bits each of red, green, blue and alpha, and 1 MB
// for all else.
size_t MaxBytes(cv::Size size) { return 8 * static_cast<size_t>(size.area()) + (1 << 20); }

std::string Text(cv::Size size) { return fmt::format("{}x{}", size.width, size.height); }

}  // namespace

ImageHeader ReadImageHeader(std::span<const uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with(kPng)) {
    return {"PNG", PngSize(bytes)};
  }
  if (text.starts_with(kJpeg)) {
    return {"JPEG", JpegSize(bytes)};
  }
  const auto other = std::ranges::find_if(
      kOthers, [text](const Signature& one) { return text.starts_with(one.begins); });
  if (other != kOthers.end()) {
    return {std::string(other->format), {}};
  }
  return {IsNetpbm(text) ? "PNM" : "", {}};
}

GreyImage DecodeGrey(std::span<const uint8_t> bytes, cv::Size expected) {
  const auto [format, size] = ReadImageHeader(bytes);
  if (format.empty()) {
    return {{}, "corrupt image: neither PNG nor JPEG", {}};
  }
  if (format != "PNG" && format != "JPEG") {
    return {{}, fmt::format("{} image; only PNG and JPEG are read", format), {}};
  }
  if (size.empty()) {
    return {{}, fmt::format("corrupt image: a {} without its size", format), {}};
  }
  if (size != expected) {
    return {{}, fmt::format("{} pixels instead of {}", Text(size), Text(expected)), size};
  }
  if (bytes.size() > MaxBytes(expected)) {
    return {{}, fmt::format("too many bytes for {} pixels", Text(expected)), size};
  }
  const cv::Mat pixels = format == "PNG" ? DecodePng(bytes, size) : DecodeJpeg(bytes, size);
  if (pixels.empty()) {
    return {{}, fmt::format("corrupt image: the {} cannot be decoded", format), size};
  }
  return {pixels, "", size};
}

GreyImage ReadGrey(const std::string& path, cv::Size expected) {
  try {
    std::ifstream file = OpenFile(path);
    file.seekg(0, std::ios::end);
    // One byte more than allowed is read, to find out whether the file is too large.
    std::vector<uint8_t> bytes(std::min(static_cast<size_t>(file.tellg()), MaxBytes(expected) + 1));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    bytes.resize(static_cast<size_t>(file.gcount()));
    return DecodeGrey(bytes, expected);
  } catch (const std::runtime_error& error) {
    return {{}, error.what(), {}};
  }
}

}  // namespace pangea

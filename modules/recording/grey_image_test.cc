#include "recording/grey_image.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

namespace pangea {
namespace {

using ::testing::HasSubstr;

const cv::Size kSize(32, 24);

std::vector<uint8_t> Encoded(const std::string& extension, cv::Size size = kSize) {
  std::vector<uint8_t> bytes;
  cv::imencode(extension, cv::Mat(size, CV_8UC1, cv::Scalar(77)), bytes);
  return bytes;
}

std::vector<uint8_t> Bytes(std::string_view text) { return {text.begin(), text.end()}; }

// A PNG whose header states this size, with pixels or without. With a huge size a decoder that
// trusts the header allocates 3.6 GB.
std::vector<uint8_t> PngThatClaims(int width, int height) {
  std::vector<uint8_t> bytes = Encoded(".png");
  for (int i = 0; i < 4; ++i) {
    bytes[16 + i] = static_cast<uint8_t>(width >> (24 - 8 * i));
    bytes[20 + i] = static_cast<uint8_t>(height >> (24 - 8 * i));
  }
  return bytes;
}

std::string Why(const std::vector<uint8_t>& bytes) {
  const GreyImage image = DecodeGrey(bytes, kSize);
  EXPECT_TRUE(image.pixels.empty());
  return image.why;
}

TEST(GreyImage, DecodesPngAndJpeg) {
  for (const char* extension : {".png", ".jpg"}) {
    const GreyImage image = DecodeGrey(Encoded(extension), kSize);
    ASSERT_EQ(image.pixels.size(), kSize) << image.why;
    EXPECT_EQ(image.pixels.at<uint8_t>(3, 3), 77);
    EXPECT_EQ(image.size, kSize);
  }
}

// Colour, alpha and 16-bit images are converted to grey as by cv::imread.
TEST(GreyImage, PixelsAreThoseOfOpenCv) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3}) {
    for (const char* extension : {".png", ".jpg"}) {
      if (CV_MAT_DEPTH(type) == CV_16U && extension == std::string_view(".jpg")) {
        continue;
      }
      cv::Mat image(kSize, type);
      cv::randu(image, 0, CV_MAT_DEPTH(type) == CV_16U ? 65536 : 256);
      std::vector<uint8_t> bytes;
      cv::imencode(extension, image, bytes);
      const cv::Mat expected = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
      const GreyImage grey = DecodeGrey(bytes, kSize);
      ASSERT_EQ(grey.pixels.size(), kSize) << grey.why;
      EXPECT_EQ(cv::norm(grey.pixels, expected, cv::NORM_INF), 0) << extension << " " << type;
    }
  }
}

TEST(GreyImage, TheSizeIsReadBeforeAPixelIsDecoded) {
  EXPECT_EQ(Why(PngThatClaims(60000, 60000)), "60000x60000 pixels instead of 32x24");
  EXPECT_EQ(Why(PngThatClaims(0, 24)), "corrupt image: a PNG without its size");
  EXPECT_EQ(Why(PngThatClaims(-1, -1)), "corrupt image: a PNG without its size");
  EXPECT_EQ(Why(Encoded(".jpg", {48, 40})), "48x40 pixels instead of 32x24");
  EXPECT_EQ(DecodeGrey(PngThatClaims(60000, 60000), kSize).size, cv::Size(60000, 60000));
}

TEST(GreyImage, OtherFormatsAreRefusedByName) {
  for (const auto& [bytes, name] : {std::pair(Encoded(".bmp"), "BMP"),
                                    {Encoded(".pgm"), "PNM"},
                                    {Encoded(".tiff"), "TIFF"},
                                    {Bytes("P5 60000 60000 255\n"), "PNM"},
                                    {Bytes("#?RADIANCE\n\n-Y 60000 +X 60000\n"), "Radiance HDR"},
                                    {Bytes("RIFF\1\1\1\1WEBPVP8 "), "WebP"}}) {
    EXPECT_EQ(Why(bytes), fmt::format("{} image; only PNG and JPEG are read", name));
  }
  EXPECT_EQ(Why(Bytes("no image")), "corrupt image: neither PNG nor JPEG");
  EXPECT_EQ(Why({}), "corrupt image: neither PNG nor JPEG");
}

void PutBigEndian(uint32_t value, std::vector<uint8_t>* bytes) {
  for (const int shift : {24, 16, 8, 0}) {
    bytes->push_back(static_cast<uint8_t>(value >> shift));
  }
}

// RFC 2083, section 4.2.3: "t", no more text, deflated: `size` letters.
std::vector<uint8_t> CompressedText(size_t size) {
  const std::vector<uint8_t> letters(size, 'a');
  std::vector<uint8_t> chunk = Bytes({"zTXtt\0\0", 7});
  uLongf length = compressBound(size);
  std::vector<uint8_t> deflated(length);
  compress(deflated.data(), &length, letters.data(), size);
  chunk.insert(chunk.end(), deflated.begin(), deflated.begin() + static_cast<long>(length));
  std::vector<uint8_t> bytes;
  PutBigEndian(static_cast<uint32_t>(chunk.size() - 4), &bytes);
  bytes.insert(bytes.end(), chunk.begin(), chunk.end());
  PutBigEndian(static_cast<uint32_t>(crc32(0, chunk.data(), static_cast<uInt>(chunk.size()))),
               &bytes);
  return bytes;
}

// 100 texts, together 600 kB in the file and 600 MB of memory.
TEST(GreyImage, TextsOfAPngAreNotUnpacked) {
  constexpr size_t kHeader = 33;
  std::vector<uint8_t> bytes = Encoded(".png");
  const std::vector<uint8_t> text = CompressedText(6'000'000);
  for (int i = 0; i < 100; ++i) {
    bytes.insert(bytes.begin() + kHeader, text.begin(), text.end());
  }
  const auto peak_kB = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;
  };
  const long before_kB = peak_kB();
  EXPECT_EQ(DecodeGrey(bytes, kSize).why, "");
  EXPECT_LT(peak_kB() - before_kB, 50'000);
}

// Each scan of a progressive JPEG costs a pass over the whole image.
TEST(GreyImage, AJpegOfManyScansIsRefused) {
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", cv::Mat(kSize, CV_8UC1, cv::Scalar(77)), bytes,
               {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  EXPECT_EQ(DecodeGrey(bytes, kSize).why, "");
  constexpr std::array<uint8_t, 2> kStartOfScan = {0xff, 0xda};
  const auto last =
      std::find_end(bytes.begin(), bytes.end(), kStartOfScan.begin(), kStartOfScan.end());
  const std::vector<uint8_t> scan(last, bytes.end() - 2);
  for (int i = 0; i < 1000; ++i) {
    bytes.insert(bytes.end() - 2, scan.begin(), scan.end());
  }
  EXPECT_EQ(Why(bytes), "corrupt image: the JPEG cannot be decoded");
}

// No exception leaves DecodeGrey, even if the image is truncated or damaged.
TEST(GreyImage, WhatIsCutOrFlippedIsNoException) {
  for (const char* extension : {".png", ".jpg"}) {
    const std::vector<uint8_t> whole = Encoded(extension);
    for (size_t length = 0; length < whole.size(); ++length) {
      const GreyImage cut = DecodeGrey(std::span(whole).first(length), kSize);
      EXPECT_EQ(cut.pixels.empty(), !cut.why.empty());
      std::vector<uint8_t> flipped = whole;
      flipped[length] ^= 0x41;
      const GreyImage odd = DecodeGrey(flipped, kSize);
      EXPECT_EQ(odd.pixels.empty(), !odd.why.empty());
    }
  }
}

TEST(GreyImage, OfAFileNothingIsThrown) {
  const std::string folder = ::testing::TempDir() + "pangea_grey_image";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  EXPECT_THAT(ReadGrey(folder + "/none.png", kSize).why, HasSubstr("No such file"));
  EXPECT_THAT(ReadGrey(folder, kSize).why, HasSubstr("it is a folder"));
  ASSERT_EQ(mkfifo((folder + "/fifo.png").c_str(), 0600), 0);
  EXPECT_THAT(ReadGrey(folder + "/fifo.png", kSize).why, HasSubstr("it is a FIFO"));
  std::vector<uint8_t> bytes = Encoded(".png");
  bytes.resize(9'000'000);
  std::ofstream(folder + "/long.png", std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), 9'000'000);
  EXPECT_EQ(ReadGrey(folder + "/long.png", kSize).why, "too many bytes for 32x24 pixels");
}

}  // namespace
}  // namespace pangea

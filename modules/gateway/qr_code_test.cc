#include "gateway/qr_code.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>
#include <opencv2/objdetect.hpp>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace pangea {
namespace {

// As a camera sees the terminal: 8 pixels a module.
cv::Mat Photograph(const std::string& drawn) {
  std::vector<std::vector<uint8_t>> rows;
  std::istringstream lines(drawn);
  for (std::string line; std::getline(lines, line);) {
    std::vector<uint8_t> upper, lower;
    for (size_t i = 0; i < line.size();) {
      const std::string sign = line.substr(i, line[i] == ' ' ? 1 : 3);
      upper.push_back(sign == "▀" || sign == "█" ? 255 : 0);
      lower.push_back(sign == "▄" || sign == "█" ? 255 : 0);
      i += sign.size();
    }
    rows.push_back(upper);
    rows.push_back(lower);
  }
  cv::Mat image(static_cast<int>(rows.size()), static_cast<int>(rows[0].size()), CV_8U);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image.at<uint8_t>(y, x) = rows[static_cast<size_t>(y)][static_cast<size_t>(x)];
    }
  }
  cv::resize(image, image, {}, 8, 8, cv::INTER_NEAREST);
  return image;
}

// Debian's OpenCV finds codes, and leaves reading them to a library that it lacks.
TEST(QrCode, ACameraFindsItWithinItsQuietZone) {
  const cv::Mat image =
      Photograph(QrCode("https://192.168.1.7:8443/#join=ABCD-EFGH-JKMN-PQRS", false));
  std::vector<cv::Point2f> corners;
  ASSERT_TRUE(cv::QRCodeDetector().detect(image, corners));
  const float quiet_px = 4 * 8, tolerance_px = 4;
  EXPECT_NEAR(corners[0].x, quiet_px, tolerance_px);
  EXPECT_NEAR(corners[0].y, quiet_px, tolerance_px);
  EXPECT_NEAR(corners[2].x, static_cast<float>(image.cols) - quiet_px, tolerance_px);
}

TEST(QrCode, SetsBothColoursWhereThereAreSome) {
  EXPECT_THAT(QrCode("a", true), testing::HasSubstr("\x1b[97;40m"));
  EXPECT_THAT(QrCode("a", true), testing::HasSubstr("\x1b[0m\n"));
  EXPECT_THROW(QrCode(std::string(5000, 'x'), false), std::runtime_error);
}

}  // namespace
}  // namespace pangea

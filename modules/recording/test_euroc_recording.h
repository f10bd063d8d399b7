#pragma once

// A EuRoC recording in a temporary folder, for tests that damage it.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <string>

#include "recording/euroc.h"

namespace pangea {

inline constexpr int64_t kEurocTestStart_ns = 1403636584763555584;

// A recording of 10 images of 32x24 pixels at 20 Hz and 1 s of IMU at 200 Hz. Each test damages it
// in a different way.
class EurocTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    root_ = ::testing::TempDir() + "pangea_euroc_" + info->name();
    std::filesystem::remove_all(root_);
    for (const char* sub : {"cam0/data", "imu0", "state_groundtruth_estimate0"}) {
      std::filesystem::create_directories(root_ + "/mav0/" + sub);
    }
    WriteCamera("radial-tangential", "32, 24");
    Write("imu0/sensor.yaml",
          kIdentity +
              "rate_hz: 200\ngyroscope_noise_density: 1e-4\ngyroscope_random_walk: 2e-5\n"
              "accelerometer_noise_density: 3e-3\naccelerometer_random_walk: 4e-3\n");
    std::string imu = "#timestamp [ns],w,w,w,a,a,a\n";
    for (int64_t i = -20; i < 180; ++i) {
      imu += fmt::format("{},0.1,0.2,0.3,0,0,9.81\n", kEurocTestStart_ns + i * 5000000);
    }
    Write("imu0/data.csv", imu);
    std::string cam = "#timestamp [ns],filename\n";
    for (int i = 0; i < 10; ++i) {
      cam += ImageRow(i);
      WriteImage(i, 32, 24);
    }
    Write("cam0/data.csv", cam);
    Write("state_groundtruth_estimate0/data.csv",
          fmt::format("#t\n{},1,2,3,1,0,0,0\n{},1,2,4,1,0,0,0\n", kEurocTestStart_ns,
                      kEurocTestStart_ns + 1000000000));
  }

  void WriteCamera(const std::string& distortion, const std::string& resolution) {
    Write("cam0/sensor.yaml",
          kIdentity + "camera_model: pinhole\nresolution: [" + resolution +
              "]\nintrinsics: [30, 31, 16, 12]\ndistortion_coefficients: [0.1, 0.01, 0, 0]\n"
              "distortion_model: " +
              distortion + "\n");
  }
  static std::string ImageRow(int i) {
    return fmt::format("{0},{0}.png\n", kEurocTestStart_ns + i * int64_t{50000000});
  }
  std::string ImagePath(int i) const {
    return fmt::format("{}/mav0/cam0/data/{}.png", root_,
                       kEurocTestStart_ns + i * int64_t{50000000});
  }
  void WriteImage(int i, int width, int height) const {
    cv::imwrite(ImagePath(i), cv::Mat(height, width, CV_8UC1, cv::Scalar(10 + i)));
  }
  void Write(const std::string& file, const std::string& text) const {
    std::ofstream(root_ + "/mav0/" + file) << text;
  }
  std::string Text(const std::string& file) const {
    std::ifstream in(root_ + "/mav0/" + file);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }
  std::string Complaint() const {
    try {
      const EurocRecording recording(root_);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }

  const std::string kIdentity =
      "T_BS:\n  rows: 4\n  cols: 4\n  data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]\n";
  std::string root_;
};

}  // namespace pangea

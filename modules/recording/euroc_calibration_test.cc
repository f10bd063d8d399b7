#include "recording/euroc_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "recording/test_complaint.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Kalibr's layouts (its wiki, "YAML formats"). The camera looks along the body's x axis, 0.1 m
// before it.
const std::string kLens =
    "  camera_model: pinhole\n  intrinsics: [190.9, 190.8, 254.9, 256.8]\n"
    "  distortion_model: equidistant\n  distortion_coeffs: [0.003, 0.0007, -0.002, 0.0002]\n"
    "  resolution: [512, 512]\n  rostopic: /cam0/image_raw\n";
const std::string kCamchain = "cam0:\n" + kLens +
                              "  T_cam_imu:\n  - [0.0, -1.0, 0.0, 0.0]\n  - [0.0, 0.0, -1.0, 0.0]\n"
                              "  - [1.0, 0.0, 0.0, -0.1]\n  - [0.0, 0.0, 0.0, 1.0]\n"
                              "  timeshift_cam_imu: 0.002\ncam1:\n  camera_model: pinhole\n";
const std::string kNoise =
    "accelerometer_noise_density: 0.0028\naccelerometer_random_walk: 0.00086\n"
    "gyroscope_noise_density: 0.00016\ngyroscope_random_walk: 2.2e-05\n"
    "rostopic: /imu0\nupdate_rate: 199.0\n";

TEST(EurocCalibration, KalibrsCamchainIsUnderstood) {
  const CameraModel camera = ParseEurocCamera(kCamchain, "camchain.yaml");
  EXPECT_EQ(camera.kind, CameraModel::Kind::kEquidistant);
  EXPECT_EQ(camera.width, 512);
  EXPECT_EQ(camera.cx, 254.9);
  EXPECT_EQ(camera.distortion[2], -0.002);
  EXPECT_EQ(camera.time_offset_s, 0.002);
  // T_cam_imu transforms points from the body to the camera; ours is the inverse.
  EXPECT_LT((camera.T_body_cam.t - Eigen::Vector3d(0.1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((camera.T_body_cam.q * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(),
            1e-12);
  EXPECT_FALSE(ParseEurocCalibrationSigmas(kCamchain, "camchain.yaml"));
}

TEST(EurocCalibration, KalibrsImuFileIsUnderstood) {
  for (const std::string& text :
       {kNoise,
        std::string("imu0:\n  T_i_b:\n  - [1, 0, 0, 0]\n  accelerometer_noise_density: 0.0028\n"
                    "  accelerometer_random_walk: 0.00086\n  gyroscope_noise_density: 0.00016\n"
                    "  gyroscope_random_walk: 2.2e-05\n  update_rate: 199.0\n")}) {
    const EurocImuCalibration imu = ParseEurocImuCalibration(text, "imu.yaml");
    EXPECT_EQ(imu.noise.accel_noise_density, 0.0028);
    EXPECT_EQ(imu.noise.gyro_random_walk, 2.2e-05);
    EXPECT_EQ(imu.noise.rate_hz, 199);
    EXPECT_EQ(imu.T_s_body.t, Eigen::Vector3d(0, 0, 0));
  }
}

// MH_01's cam0 with three digits.
const std::string kRounded =
    "T_BS: {data: [0.015, -1.0, 0.004, -0.022, 1.0, 0.015, 0.026, -0.065, -0.026, 0.004, 1.0, "
    "0.01, "
    "0, 0, 0, 1]}\n";

TEST(EurocCalibration, ARoundedRotationIsRepairedAndNamed) {
  std::string lens = kLens + kRounded;
  lens.replace(lens.find("  camera_model"), 2, "");
  for (size_t at = 0; (at = lens.find("\n  ", at)) != std::string::npos;) {
    lens.erase(at + 1, 2);
  }
  std::vector<std::string> warnings;
  const CameraModel camera = ParseEurocCamera(lens, "sensor.yaml", &warnings);
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("sensor.yaml: the rotation in 'T_BS' is rounded")));
  EXPECT_NEAR(camera.T_body_cam.q.norm(), 1, 1e-12);
  Eigen::Matrix3d exact;
  exact << 0.0148655429818, -0.999880929698, 0.00414029679422, 0.999557249008, 0.0149672133247,
      0.025715529948, -0.0257744366974, 0.00375618835797, 0.999660727178;
  EXPECT_LT(camera.T_body_cam.q.angularDistance(Eigen::Quaterniond(exact)), 1e-3);
  ParseEurocCamera(kCamchain, "camchain.yaml", &(warnings = {}));
  EXPECT_THAT(warnings, IsEmpty());
}

TEST(EurocCalibration, AMatrixThatIsNoRotationIsRefusedWithTheMend) {
  const auto imu = [](const std::string& data) {
    return Complaint([&] {
      ParseEurocImuCalibration("rate_hz: 200\nT_BS: {data: [" + data + "]}\n", "imu.yaml");
    });
  };
  EXPECT_THAT(imu("1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1"),
              HasSubstr("is left-handed (det -1): one axis has the wrong sign"));
  EXPECT_THAT(imu("0.98, 0.2, 0, 0, -0.2, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1"),
              HasSubstr("columns must have length 1 and right angles; give at least three digits"));
  EXPECT_THAT(imu("1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0.1, 0, 0, 1"),
              HasSubstr("is the matrix given column by column?"));
}

TEST(EurocCalibration, WhatALensModelLacksIsSaid) {
  const auto parse = [](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    return Complaint([&] { ParseEurocCamera(text, "camchain.yaml"); });
  };
  EXPECT_EQ(parse(kCamchain, "0.0002]", "0.0002, 0.0]"), "");
  EXPECT_THAT(parse(kCamchain, "0.0002]", "0.0002, 0.1]"), HasSubstr("a fifth number, k3 = 0.1"));
  EXPECT_THAT(parse(kCamchain, "camera_model: pinhole", "camera_model: omni"),
              HasSubstr("'camera_model' must be pinhole; for a wide lens"));
  EXPECT_THAT(parse(kCamchain, "T_cam_imu", "T_cn_cnm1"), HasSubstr("field 'T_BS'"));
  EXPECT_THAT(parse(kCamchain, "-0.1]\n", "-0.1, 1.0]\n"),
              HasSubstr("field 'T_cam_imu' must be a 4x4 matrix"));
}

TEST(EurocCalibration, ASensorOfAnotherNameIsNoCamera) {
  const std::string cam1 = "cam1:\n" + kCamchain.substr(kCamchain.find('\n') + 1);
  EXPECT_THAT(
      Complaint([&] { ParseEurocCamera(cam1.substr(0, cam1.rfind("cam1:")), "camchain.yaml"); }),
      HasSubstr("no sensor 'cam0' in it; it has cam1: rename"));
}

TEST(EurocCalibration, AFieldGivenTwiceOrNotAtAllIsNamed) {
  const auto camera = [](const std::string& text) {
    return Complaint([&] { ParseEurocCamera(text, "cam0/sensor.yaml"); });
  };
  std::string text = kCamchain;
  EXPECT_THAT(camera(text.insert(text.find("  resolution"), "  intrinsics: [1, 1, 1, 1]\n")),
              HasSubstr("field 'intrinsics' is given twice"));
  text = kCamchain;
  text.replace(text.find("intrinsics"), 10, "intrinsic");
  EXPECT_THAT(camera(text), HasSubstr("field 'intrinsics', a list of 4 numbers, is missing"));
  text = kCamchain;
  text.replace(text.find("254.9"), 5, "5000");
  EXPECT_THAT(camera(text), HasSubstr("the principal point (5000, 256.8) is far outside"));
  text = kNoise;
  text.replace(text.find("0.00016"), 7, "1e6");
  EXPECT_THAT(
      Complaint([&] { ParseEurocImuCalibration(text, "imu.yaml"); }),
      HasSubstr("field 'gyroscope_noise_density' must be above 0 and at most 10, not 1000000"));
}

TEST(EurocCalibration, IsFoundBesideTheFolderAsInTumVi) {
  const std::string root = ::testing::TempDir() + "pangea_tum_vi";
  fs::remove_all(root);
  fs::create_directories(root + "/mav0/cam0");
  EXPECT_THAT(
      Complaint([&] { EurocCalibrationFile(root + "/mav0", "cam0"); }),
      HasSubstr("mav0/cam0/sensor.yaml: there is no such file. Kalibr's camchain-imucam.yaml"));
  fs::create_directories(root + "/dso");
  std::ofstream(root + "/dso/camchain.yaml") << kCamchain;
  EXPECT_EQ(ReadEurocCamera(EurocCalibrationFile(root + "/mav0", "cam0")).width, 512);
  std::ofstream(root + "/mav0/cam0/sensor.yaml") << "a: 1\n";  // comes first
  EXPECT_EQ(EurocCalibrationFile(root + "/mav0", "cam0"), root + "/mav0/cam0/sensor.yaml");
}

}  // namespace
}  // namespace pangea

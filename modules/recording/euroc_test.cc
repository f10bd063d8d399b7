#include "recording/euroc.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "recording/test_euroc_recording.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(EurocTest, ReadsASoundRecordingWithoutWarnings) {
  const EurocRecording recording(root_);
  EXPECT_THAT(recording.warnings(), IsEmpty());
  ASSERT_EQ(recording.images().size(), 10U);
  EXPECT_EQ(recording.images()[0].utime, kEurocTestStart_ns / 1000);
  EXPECT_EQ(recording.images()[0].stamp_ns, kEurocTestStart_ns);
  EXPECT_EQ(recording.imu().size(), 200U);
  EXPECT_EQ(recording.imu()[0].accel, Eigen::Vector3d(0, 0, 9.81));
  EXPECT_EQ(recording.imu_noise().gyro_noise_density, 1e-4);
  EXPECT_EQ(recording.imu_noise().accel_random_walk, 4e-3);
  EXPECT_EQ(recording.imu_noise().gyro_scale_sigma, ImuNoise{}.gyro_scale_sigma);  // not given
  EXPECT_EQ(recording.camera().kind, CameraModel::Kind::kRadtan);
  EXPECT_EQ(recording.camera().fy, 31);
  EXPECT_EQ(recording.ground_truth().size(), 2U);
  std::string why;
  const cv::Mat image = recording.LoadImage(3, &why);
  EXPECT_EQ(image.at<uint8_t>(5, 5), 13);
  EXPECT_EQ(why, "");
}

TEST_F(EurocTest, TakesTheInnerFolderToo) {
  EXPECT_EQ(EurocRecording(root_ + "/mav0").images().size(), 10U);
}

TEST_F(EurocTest, BodyIsTheImuWhereverTheRigIs) {
  // The IMU sits 1 m along x of the rig, the ground truth 2 m along y.
  const std::string yaml = Text("imu0/sensor.yaml");
  std::string moved = yaml;
  moved.replace(moved.find("1,0,0,0,"), 8, "1,0,0,1,");
  Write("imu0/sensor.yaml", moved);
  std::string truth = kIdentity;
  truth.replace(truth.find(" 0,1,0,0,"), 9, " 0,1,0,2,");
  Write("state_groundtruth_estimate0/sensor.yaml", truth);
  const EurocRecording recording(root_);
  EXPECT_EQ(recording.camera().T_body_cam.t, Eigen::Vector3d(-1, 0, 0));
  EXPECT_EQ(recording.ground_truth()[0].T.t, Eigen::Vector3d(1 + 1, 2 - 2, 3));
  std::vector<std::string> warnings;
  EXPECT_EQ(ReadEurocGroundTruthOf(root_, &warnings)[0].T.t, Eigen::Vector3d(2, 0, 3));
}

TEST_F(EurocTest, TheGroundTruthIsReadBesideKalibrsImuFileToo) {
  Write("imu0/sensor.yaml",
        "imu0:\n  accelerometer_noise_density: 0.002\n  accelerometer_random_walk: 0.003\n"
        "  gyroscope_noise_density: 0.0002\n  gyroscope_random_walk: 2.2e-05\n"
        "  update_rate: 200.0\n");
  std::vector<std::string> warnings;
  const Trajectory truth = ReadEurocGroundTruthOf(root_, &warnings);
  ASSERT_FALSE(truth.empty());
  EXPECT_EQ(truth[0].T.t, EurocRecording(root_).ground_truth()[0].T.t);
}

TEST_F(EurocTest, TheFirstImageIsNotAFarStamp) {
  const std::string images = Text("cam0/data.csv");
  const std::optional<int64_t> first = FirstImageUtimeOf(root_);
  EXPECT_EQ(first, EurocRecording(root_).images().front().utime);
  Write("cam0/data.csv", images + "0,0.png\n");
  EXPECT_EQ(FirstImageUtimeOf(root_), first);
}

TEST_F(EurocTest, EquidistantOffsetAndReadout) {
  WriteCamera("equidistant", "32, 24");
  Write("cam0/sensor.yaml", Text("cam0/sensor.yaml") + "time_offset_s: -0.003\nreadout_s: 0.02\n");
  const CameraModel camera = EurocRecording(root_).camera();
  EXPECT_EQ(camera.kind, CameraModel::Kind::kEquidistant);
  EXPECT_EQ(camera.time_offset_s, -0.003);
  EXPECT_EQ(camera.readout_s, 0.02);
}

TEST_F(EurocTest, TheTimeOffsetIsThatOfTheFirstRow) {
  WriteCamera("radtan", "32, 24");
  const std::string camera = Text("cam0/sensor.yaml") + "readout_s: 0.02\n";
  const auto offset = [&](const std::string& fields) {
    Write("cam0/sensor.yaml", camera + fields);
    return EurocRecording(root_).camera().time_offset_s;
  };
  EXPECT_DOUBLE_EQ(offset("timeshift_cam_imu: -0.003\n"), -0.013);  // Kalibr's: the middle row's
  EXPECT_DOUBLE_EQ(offset("timeshift_cam_imu: -0.003\nstamp_row: first\n"), -0.003);
  EXPECT_DOUBLE_EQ(offset("time_offset_s: -0.003\nstamp_row: middle\n"), -0.013);
  EXPECT_DOUBLE_EQ(offset("time_offset_s: -0.003\nstamp_row: last\n"), -0.023);
  EXPECT_DOUBLE_EQ(offset("stamp_row: last\n"), -0.02);
  Write("cam0/sensor.yaml", camera + "stamp_row: upper\n");
  EXPECT_THAT(Complaint(), HasSubstr("'stamp_row: upper' is not known; known: first, middle"));
}

TEST_F(EurocTest, HowWellTheCalibrationIsKnown) {
  WriteCamera("radtan", "32, 24");
  EXPECT_FALSE(EurocRecording(root_).calibration_sigmas());
  const std::string camera = Text("cam0/sensor.yaml");
  const double focal_px = EurocRecording(root_).camera().fx;
  Write("cam0/sensor.yaml", camera + "rotation_sigma: [0.001, 0.004, 0.002]\n" +
                                "intrinsics_sigma: [2, 2.5, 1.5, 1]\n" +
                                "distortion_sigma: [0.003, 0.02]\n");
  const auto sigmas = EurocRecording(root_).calibration_sigmas();
  ASSERT_TRUE(sigmas);
  EXPECT_EQ(sigmas->rotation, 0.004);
  EXPECT_DOUBLE_EQ(sigmas->focal, 2.5 / focal_px);
  EXPECT_DOUBLE_EQ(sigmas->centre, 1.5 / focal_px);
  EXPECT_EQ(sigmas->distortion, 0.02);
  EXPECT_EQ(sigmas->position_m, CalibrationSigmas{}.position_m);  // not given
  Write("cam0/sensor.yaml", camera + "time_offset_sigma: -0.001\n");
  EXPECT_THAT(Complaint(), HasSubstr("'time_offset_sigma' must be 0 or above"));
  Write("cam0/sensor.yaml", camera + "rotation_sigma: [-1, 0.01, 0.01]\n");
  EXPECT_THAT(Complaint(), HasSubstr("'rotation_sigma' must be 0 or above, and below 1, not -1"));
  Write("cam0/sensor.yaml", camera + "translation_sigma: 0\n");
  EXPECT_THAT(Complaint(),
              HasSubstr("'translation_sigma' must be above 0: nothing is known exactly"));
}

TEST_F(EurocTest, MissingPartsAreNamed) {
  EXPECT_THROW(EurocRecording("/nonexistent/recording"), std::runtime_error);
  fs::remove(root_ + "/mav0/imu0/data.csv");
  EXPECT_THAT(Complaint(), HasSubstr("imu0/data.csv: cannot be opened: No such file"));
  fs::remove(root_ + "/mav0/cam0/sensor.yaml");
  EXPECT_THAT(Complaint(), HasSubstr("cam0/sensor.yaml: there is no such file"));
  fs::remove_all(root_ + "/mav0");
  EXPECT_THAT(Complaint(), HasSubstr("the folder is empty"));
  std::ofstream(root_ + "/notes.txt") << "notes";
  EXPECT_THAT(Complaint(), HasSubstr("must hold mav0/cam0 and mav0/imu0"));
}

TEST_F(EurocTest, WhatElseSomebodyMayGiveIsNamed) {
  const std::string outer = root_ + "_outer";
  fs::remove_all(outer);
  fs::create_directories(outer);
  fs::rename(root_, outer + "/MH_01");
  root_ = outer;
  EXPECT_THAT(Complaint(), HasSubstr("but " + outer + "/MH_01 is one"));
  for (const auto& [name, says] : {std::pair("MH_01.zip", "a file: unpack it"),
                                   std::pair("MH_01.bag", "a ROS bag: write its topics")}) {
    root_ = fmt::format("{}/{}", outer, name);
    std::ofstream(root_) << "PK";
    EXPECT_THAT(Complaint(), HasSubstr(says));
  }
}

TEST_F(EurocTest, ANameFindsTheOnlyRecordingThatContinuesIt) {
  const fs::path outer = root_ + "_outer";
  fs::remove_all(outer);
  fs::create_directories(outer / "MH_01_notes");
  fs::create_directories(outer / "MH_010" / "mav0");
  fs::rename(root_, outer / "MH_01_easy");
  root_ = outer;
  EXPECT_EQ(FindRecording(outer / "MH_01"), outer / "MH_01_easy");
  EXPECT_EQ(FindRecording(outer / "MH_01" / ""), outer / "MH_01_easy");
  EXPECT_EQ(FindRecording(outer / "MH_01_easy"), outer / "MH_01_easy");
  EXPECT_EQ(FindRecording(outer / "MH_01_easy" / "mav0"), outer / "MH_01_easy" / "mav0");
  EXPECT_EQ(FindRecording(outer / "MH_02"), std::nullopt);
  const fs::path here = fs::current_path();
  fs::current_path(outer);
  EXPECT_EQ(FindRecording("MH_01"), fs::path("./MH_01_easy"));
  fs::current_path(here);
  fs::create_directories(outer / "MH_01_again" / "mav0");
  EXPECT_EQ(FindRecording(outer / "MH_01"), std::nullopt) << "which of the two?";
}

TEST_F(EurocTest, ImagesWithoutAStampAreCounted) {
  Write("cam0/data.csv", ImageRow(0) + ImageRow(1) + ImageRow(3));
  const EurocRecording recording(root_);
  EXPECT_EQ(recording.images().size(), 3U);
  EXPECT_THAT(recording.warnings(),
              Contains(HasSubstr("7 files have no row in " + root_ + "/mav0/cam0/data.csv, " +
                                 fs::path(ImagePath(2)).filename().string() + " the first")));
}

TEST_F(EurocTest, CalibrationMistakesNameTheField) {
  WriteCamera("fisheye62", "32, 24");
  EXPECT_THAT(Complaint(), HasSubstr("distortion_model: fisheye62"));
  WriteCamera("radtan", "32");
  EXPECT_THAT(Complaint(), HasSubstr("'resolution' must be a list of 2 numbers"));
  WriteCamera("radtan", "64, 48");
  EXPECT_THAT(Complaint(), HasSubstr("png: 32x24 pixels instead of 64x48"));
  WriteCamera("radtan", "32, 24");
  std::string imu = Text("imu0/sensor.yaml");
  Write("imu0/sensor.yaml", imu.substr(0, imu.find("accelerometer_random_walk")));
  EXPECT_THAT(Complaint(), HasSubstr("'accelerometer_random_walk' is missing"));
  Write("imu0/sensor.yaml", imu + "axes_sigma: -0.01\n");
  EXPECT_THAT(Complaint(), HasSubstr("'axes_sigma' must be 0 (exact) or above, not -0.01"));
  imu.replace(imu.find("data: [1,0"), 10, "data: [2,0");
  Write("imu0/sensor.yaml", imu);
  EXPECT_THAT(Complaint(), HasSubstr("the rotation in 'T_BS' is not one"));
}

TEST_F(EurocTest, FieldsThatAreNotReadAreNamed) {
  Write("cam0/sensor.yaml", Text("cam0/sensor.yaml") +
                                "comment: mine\nrate_hz: 20\nreadout_s: 0.01\n" +
                                "time_ofset_s: 0.04\nexposure: 3\n");
  Write("imu0/sensor.yaml", Text("imu0/sensor.yaml") + "axes_sgima: 0.01\n");
  EXPECT_THAT(
      EurocRecording(root_).warnings(),
      ElementsAre(HasSubstr("cam0/sensor.yaml: field 'time_ofset_s' is not known, and not read; "
                            "did you mean 'time_offset_s'?"),
                  AllOf(HasSubstr("field 'exposure'"), Not(HasSubstr("did you mean"))),
                  HasSubstr("did you mean 'axes_sigma'?")));
  WriteCamera("radial-tangential", "32, 24");
  Write("imu0/sensor.yaml",
        Text("imu0/sensor.yaml").substr(0, Text("imu0/sensor.yaml").find("axes")));
  Write("cam0/sensor.yaml",
        Text("cam0/sensor.yaml") + "time_offset_s: 0\ntimeshift_cam_imu: 0.01\n");
  EXPECT_THAT(EurocRecording(root_).warnings(),
              ElementsAre(HasSubstr("only the first is read; keep one")));
}

// The IMU is from 0.1 s before the first image to 0.895 s after it; the last image is at 0.45 s.
TEST_F(EurocTest, ImagesOutsideTheImusTimeAreDroppedByTheTimeOffset) {
  const std::string camera = Text("cam0/sensor.yaml");
  const auto count = [&](double offset_s) {
    Write("cam0/sensor.yaml", camera + fmt::format("time_offset_s: {}\n", offset_s));
    return EurocRecording(root_).images().size();
  };
  EXPECT_EQ(count(0), 10u);
  EXPECT_EQ(count(-0.22), 7u);
  EXPECT_EQ(count(0.62), 6u);
}

}  // namespace
}  // namespace pangea

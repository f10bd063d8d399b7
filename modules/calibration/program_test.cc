#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <tuple>

#include "calibration/calibration_folder.h"
#include "calibration/priors.h"
#include "calibration/recording_tracks.h"
#include "calibration/sensor_yaml.h"
#include "calibration/summary.h"
#include "core/rigid3.h"
#include "files/text_file.h"
#include "recording/euroc.h"
#include "recording/euroc_calibration.h"
#include "recording/sensor_file.h"

namespace pangea::calibration {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

class Program : public testing::Test {
 protected:
  Program() : folder_(fs::temp_directory_path() / "pangea_calibration_program_test") {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Program() override { fs::remove_all(folder_); }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  // Images and samples, and no sensor.yaml.
  void MakeRecording() const {
    fs::create_directories(folder_ / "in/mav0/cam0/data");
    fs::create_directories(folder_ / "in/mav0/imu0");
    std::string images, imu;
    for (int64_t i = 0; i < 3; ++i) {
      const std::string name = std::to_string(i) + ".png";
      cv::imwrite(Path("in/mav0/cam0/data/" + name), cv::Mat(48, 64, CV_8UC1, cv::Scalar(90)));
      images += std::to_string(50'000'000 * (i + 1)) + "," + name + "\n";
    }
    for (int64_t i = 0; i < 60; ++i) {
      imu += std::to_string(5'000'000 * i) + ",0,0,0,0,0,9.81\n";
    }
    WriteTextFile(Path("in/mav0/cam0/data.csv"), images);
    WriteTextFile(Path("in/mav0/imu0/data.csv"), imu);
  }

  fs::path folder_;
};

Result Some() {
  Result result;
  CameraModel& camera = result.parameters.camera;
  camera.kind = CameraModel::Kind::kEquidistant;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 484.125;
  camera.cx = 321.5;
  camera.cy = 236.25;
  camera.distortion << -0.0625, 0.125, 0, 0;
  camera.readout_s = 0.03;
  camera.time_offset_s = -0.05;
  camera.T_body_cam.q = ExpSo3({0.1, -0.2, 2.5});
  result.parameters.gyro_bias = {0.01, 0.02, 0.03};
  result.sigma.setConstant(1e-3);
  result.sigma_px = 0.5;
  result.coverage.seconds = 30;
  result.coverage.points = 60;
  result.coverage.rotation_rms.setConstant(0.5);
  return result;
}

TEST_F(Program, WhatIsWrittenIsReadAgain) {
  const Result some = Some();
  WriteTextFile(Path("cam.yaml"), CameraYaml(some, 30));
  const CameraModel camera = ReadEurocCamera(Path("cam.yaml"));
  Parameters read;
  read.camera = camera;
  read.gyro_bias = some.parameters.gyro_bias;
  EXPECT_LT(read.Minus(some.parameters).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_EQ(camera.kind, CameraModel::Kind::kEquidistant);
  WriteTextFile(Path("imu.yaml"), ImuYaml(some, {.gyro_noise_density = 7e-4,
                                                 .gyro_scale_sigma = 0.02,
                                                 .accel_scale_sigma = 0.03,
                                                 .axes_sigma = 0}));
  const ImuNoise noise = ReadEurocImuCalibration(Path("imu.yaml")).noise;
  EXPECT_DOUBLE_EQ(noise.gyro_noise_density, 7e-4);
  EXPECT_DOUBLE_EQ(noise.gyro_scale_sigma, 0.02);
  EXPECT_DOUBLE_EQ(noise.accel_scale_sigma, 0.03);
  EXPECT_EQ(noise.axes_sigma, 0);
}

TEST_F(Program, WhatIsWrittenIsKnownToReaders) {
  WriteTextFile(Path("cam.yaml"), CameraYaml(Some(), 30));
  EXPECT_THAT(UnreadFields(Path("cam.yaml"), "cam0"), testing::IsEmpty());
  WriteTextFile(Path("imu.yaml"), ImuYaml(Some(), {}));
  EXPECT_THAT(UnreadFields(Path("imu.yaml"), "imu0"), testing::IsEmpty());
}

TEST_F(Program, TheTimeOffsetIsAsUncertainAsTheExposureMakesIt) {
  Result some = Some();
  some.sigma[kTimeOffset] = 0.004;
  some.time_offset_spread_s = 0.003;
  EXPECT_THAT(CameraYaml(some, 30), HasSubstr("time_offset_sigma: 0.005 "));
}

TEST_F(Program, RecordingWithoutCalibrationIsLinkedAndOpens) {
  MakeRecording();
  const CalibrationFolder folder(Path("in"), Path("out/"));
  const EurocRecording recording(folder.part());
  EXPECT_EQ(recording.images().size(), 3U);
  EXPECT_EQ(recording.camera().width, 64);
  EXPECT_TRUE(fs::is_symlink(folder_ / "out.part/mav0/cam0/data"));
  EXPECT_FALSE(fs::exists(folder_ / "in/mav0/cam0/sensor.yaml"));
  EXPECT_EQ(folder.AboutTheRecording(folder.part() + "/mav0/cam0: no"), Path("in/mav0/cam0: no"));
  const Input input = TracksOf(recording, {}, std::nullopt);
  EXPECT_EQ(input.frames.size(), 3U);
  EXPECT_THAT(Calibrate(input).refused, HasSubstr("record longer"));
}

TEST_F(Program, OnlyACalibratedFolderIsThereInTheEnd) {
  MakeRecording();
  { const CalibrationFolder refused(Path("in"), Path("out")); }
  EXPECT_FALSE(fs::exists(Path("out")));
  EXPECT_FALSE(fs::exists(Path("out.part")));
  CalibrationFolder(Path("in"), Path("out")).Finish(Some(), {}, "known");
  EXPECT_FALSE(fs::exists(Path("out.part")));
  EXPECT_EQ(ReadTextFile(Path("out/calibration.txt")), "known");
  EXPECT_DOUBLE_EQ(ReadEurocCamera(Path("out/mav0/cam0/sensor.yaml")).fx,
                   Some().parameters.camera.fx);
}

// As EuRoC's: ground truth is that of the rig, and the IMU is elsewhere on it.
TEST_F(Program, TheGroundTruthStaysThatOfTheImu) {
  MakeRecording();
  const Rigid3 T_s_body(ExpSo3({0, 0, 1.5}), {0.5, -0.25, 1});
  WriteTextFile(Path("in/mav0/imu0/sensor.yaml"), ImuYaml(Some(), ImuNoise{}, T_s_body));
  fs::create_directories(folder_ / "in/mav0/state_groundtruth_estimate0");
  WriteTextFile(Path("in/mav0/state_groundtruth_estimate0/data.csv"),
                "#t\n100000000,1,2,3,1,0,0,0\n");
  Result result = Some();
  CameraModel& camera = result.parameters.camera;
  std::tie(camera.width, camera.height, camera.cx, camera.cy) = std::tuple(64, 48, 32, 24);
  CalibrationFolder(Path("in"), Path("out")).Finish(result, {}, "known");
  std::vector<std::string> warnings;
  const Trajectory before = ReadEurocGroundTruthOf(Path("in"), &warnings);
  const EurocRecording after(Path("out"));
  ASSERT_EQ(after.ground_truth().size(), 1u);
  EXPECT_LT((before[0].T.t - Eigen::Vector3d(1.5, 1.75, 4)).norm(), 1e-8);
  EXPECT_LT(before[0].T.Minus(after.ground_truth()[0].T).norm(), 1e-8);
  EXPECT_LT(after.camera().T_body_cam.Minus(camera.T_body_cam).norm(), 1e-8);
}

TEST_F(Program, TheNoiseOfTumVisFileIsKept) {
  MakeRecording();
  fs::create_directories(folder_ / "in/dso");
  WriteTextFile(Path("in/dso/imu_config.yaml"),
                "accelerometer_noise_density: 0.0028\naccelerometer_random_walk: 0.00086\n"
                "gyroscope_noise_density: 0.00016\ngyroscope_random_walk: 0.000022\n"
                "update_rate: 200.0\n");
  const CalibrationFolder folder(Path("in"), Path("out"));
  EXPECT_DOUBLE_EQ(EurocRecording(folder.part()).imu_noise().gyro_noise_density, 0.00016);
}

TEST_F(Program, WhatIsNoRecordingAndWhatExistsIsRefusedWithTheMend) {
  const auto complaint = [&](const std::string& from, const std::string& to) -> std::string {
    try {
      const CalibrationFolder folder(Path(from), Path(to));
    } catch (const std::exception& error) {
      return error.what();
    }
    return "";
  };
  MakeRecording();
  EXPECT_THAT(complaint(".", "out"), HasSubstr("must hold mav0/cam0 and mav0/imu0"));
  EXPECT_THAT(complaint("in", "in"), HasSubstr("give another --out"));
  EXPECT_EQ(complaint("in", "out"), "");
  fs::create_directories(Path("out.part/somebody's"));
  EXPECT_THAT(complaint("in", "out"), HasSubstr("out.part: is there already"));
  EXPECT_TRUE(fs::exists(Path("out.part/somebody's")));
}

TEST(Summary, SaysWhatToDoBetter) {
  Result result = Some();
  EXPECT_THAT(Summary({}, result), Not(HasSubstr("better:")));
  result.coverage.rotation_rms = {0.5, 0.05, 0.5};
  result.coverage.points = 20;
  result.refused = "the focal length is known to 9 % only";
  const std::string text = Summary({}, result);
  EXPECT_THAT(text, HasSubstr("better: rotate more left and right"));
  EXPECT_THAT(text, HasSubstr("better: more light"));
  EXPECT_THAT(text, HasSubstr("no calibration: the focal length"));
}

TEST(Summary, SaysWhichAxesToGive) {
  Result result;
  result.refused = "the camera's x, y, z do not point along the IMU's x,y,z as given";
  result.better_q_body_cam = Eigen::Quaterniond(Eigen::Vector4d(0, 0, 0, 1));  // x, y, z, w
  EXPECT_THAT(Summary({}, result), HasSubstr("better: --camera-axes=x,y,z, or none"));
}

TEST(Summary, SaysWhatTheMotionDidNotTell) {
  Result result = Some();
  Input input;
  input.width = 640;
  input.height = 480;
  EXPECT_THAT(Summary(input, result), Not(HasSubstr("not told")));
  result.sigma[kDistortion] = 0.028;  // the prior of an equidistant lens is 0.03
  EXPECT_THAT(Summary(input, result), HasSubstr("as assumed"));
  result.sigma[kDistortion] = 1e-3;
  EXPECT_THAT(Summary(input, result), Not(HasSubstr("as assumed")));
  result.sigma[kReadout] = 0.011;
  EXPECT_THAT(Summary(input, result), HasSubstr("as assumed"));
  EXPECT_THAT(Summary(input, result), HasSubstr("per change of the image interval"));
  result.sigma[kIntervalShare] = kSigmaIntervalShare;
  EXPECT_THAT(Summary(input, result), Not(HasSubstr("per change of the image interval")));
}

}  // namespace
}  // namespace pangea::calibration

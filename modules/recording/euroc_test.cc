#include "recording/euroc.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>

namespace pangea {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int64_t kStart = 1403636584763555584;

// A recording of 10 images of 32x24 pixels at 20 Hz and 1 s of IMU at 200 Hz. Each test damages it
// in a different way.
class EurocTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    root_ = ::testing::TempDir() + "pangea_euroc_" + info->name();
    fs::remove_all(root_);
    for (const char* sub : {"cam0/data", "imu0", "state_groundtruth_estimate0"}) {
      fs::create_directories(root_ + "/mav0/" + sub);
    }
    WriteCamera("radial-tangential", "32, 24");
    Write("imu0/sensor.yaml",
          kIdentity +
              "rate_hz: 200\ngyroscope_noise_density: 1e-4\ngyroscope_random_walk: 2e-5\n"
              "accelerometer_noise_density: 3e-3\naccelerometer_random_walk: 4e-3\n");
    std::string imu = "#timestamp [ns],w,w,w,a,a,a\n";
    for (int64_t i = -20; i < 180; ++i) {
      imu += fmt::format("{},0.1,0.2,0.3,0,0,9.81\n", kStart + i * 5000000);
    }
    Write("imu0/data.csv", imu);
    std::string cam = "#timestamp [ns],filename\n";
    for (int i = 0; i < 10; ++i) {
      cam += ImageRow(i);
      WriteImage(i, 32, 24);
    }
    Write("cam0/data.csv", cam);
    Write("state_groundtruth_estimate0/data.csv",
          fmt::format("#t\n{},1,2,3,1,0,0,0\n{},1,2,4,1,0,0,0\n", kStart, kStart + 1000000000));
  }

  void WriteCamera(const std::string& distortion, const std::string& resolution) {
    Write("cam0/sensor.yaml",
          kIdentity + "camera_model: pinhole\nresolution: [" + resolution +
              "]\nintrinsics: [30, 31, 16, 12]\ndistortion_coefficients: [0.1, 0.01, 0, 0]\n"
              "distortion_model: " +
              distortion + "\n");
  }
  static std::string ImageRow(int i) {
    return fmt::format("{0},{0}.png\n", kStart + i * int64_t{50000000});
  }
  std::string ImagePath(int i) const {
    return fmt::format("{}/mav0/cam0/data/{}.png", root_, kStart + i * int64_t{50000000});
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

TEST_F(EurocTest, ReadsASoundRecordingWithoutWarnings) {
  const EurocRecording recording(root_);
  EXPECT_THAT(recording.warnings(), IsEmpty());
  ASSERT_EQ(recording.images().size(), 10U);
  EXPECT_EQ(recording.images()[0].utime, kStart / 1000);
  EXPECT_EQ(recording.images()[0].stamp_ns, kStart);
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

TEST_F(EurocTest, StampsInMicrosecondsAreNamed) {
  const std::string columns = "#timestamp [ns],filename\n";
  std::string nanoseconds, microseconds;
  for (int i = 9; i >= 0; --i) {  // neither the order nor repeats matter
    nanoseconds += ImageRow(i) + ImageRow(i);
    microseconds +=
        fmt::format("{},{}.png\n", kStart / 1000 + i * 50'000, kStart + i * int64_t{50000000});
  }
  Write("cam0/data.csv", columns + microseconds);
  EXPECT_THAT(Complaint(), HasSubstr("cam0/data.csv: its images are 50 us apart: are the stamps "
                                     "nanoseconds?"));
  Write("cam0/data.csv", columns + nanoseconds);
  EXPECT_EQ(Complaint(), "");
}

TEST_F(EurocTest, WhatNoSensorShowsIsDropped) {
  Write("imu0/data.csv",
        Text("imu0/data.csv") + fmt::format("{},1e30,0,0,0,0,9.81\n", kStart + 905000000));
  const EurocRecording recording(root_);
  EXPECT_THAT(
      recording.warnings(),
      ElementsAre(HasSubstr("imu0/data.csv:202: above 100 rad/s or 500 m/s^2, which no sensor "
                            "shows; row dropped")));
}

TEST_F(EurocTest, UnsortedAndDoubledImagesAreSortedAndDropped) {
  std::string cam = ImageRow(1) + ImageRow(0) + ImageRow(0);
  for (int i = 2; i < 10; ++i) {
    cam += ImageRow(i);
  }
  Write("cam0/data.csv", cam);
  const EurocRecording recording(root_);
  ASSERT_EQ(recording.images().size(), 10U);
  EXPECT_EQ(recording.images()[0].stamp_ns, kStart);
  EXPECT_THAT(recording.warnings(), Contains(HasSubstr("1 rows out of order; sorted")));
  EXPECT_THAT(recording.warnings(), Contains(HasSubstr("1 rows with a stamp already seen")));
}

TEST_F(EurocTest, MissingImagesAreDroppedAndGapsNamed) {
  for (const int i : {4, 5, 6}) {
    fs::remove(ImagePath(i));
  }
  const EurocRecording recording(root_);
  EXPECT_EQ(recording.images().size(), 7U);
  EXPECT_THAT(recording.warnings(), Contains(HasSubstr("data.csv:6: image data/")));
  EXPECT_THAT(recording.warnings(), Contains(HasSubstr("gap of 0.200 s after 0.150 s")));
  fs::remove_all(root_ + "/mav0/cam0/data");
  EXPECT_THAT(Complaint(), HasSubstr("none of its 10 images"));
}

TEST_F(EurocTest, CorruptAndMismatchedImagesAreNamedWhenLoaded) {
  std::ofstream(ImagePath(2)) << "no png";
  WriteImage(3, 16, 12);
  const EurocRecording recording(root_);
  std::string why;
  EXPECT_TRUE(recording.LoadImage(2, &why).empty());
  EXPECT_THAT(why, HasSubstr("corrupt image"));
  EXPECT_TRUE(recording.LoadImage(3, &why).empty());
  EXPECT_THAT(why, HasSubstr("16x12 pixels instead of 32x24"));
  EXPECT_FALSE(recording.LoadImage(4, &why).empty());
}

// A PNG whose header claims more pixels than a decoder would take, and files of other formats.
TEST_F(EurocTest, OddAndOversizedImagesAreSkippedByName) {
  std::vector<uint8_t> png;
  cv::imencode(".png", cv::Mat(24, 32, CV_8UC1, cv::Scalar(1)), png);
  for (const size_t i : {16U, 20U}) {  // big-endian width and height: 60000
    png[i + 2] = 0xea;
    png[i + 3] = 0x60;
  }
  std::ofstream(ImagePath(0), std::ios::binary)
      .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
  std::ofstream(ImagePath(1)) << "P5 60000 60000 255\n";
  std::ofstream(ImagePath(2)) << "BM....";
  std::ofstream(ImagePath(3)) << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n";
  const EurocRecording recording(root_);
  ASSERT_EQ(recording.images().size(), 10U);
  std::string why;
  for (const auto& [i, what] : {std::pair(0, "60000x60000 pixels instead of 32x24, skipped"),
                                {1, "PNM image; only PNG and JPEG are read, skipped"},
                                {2, "BMP image; only PNG and JPEG are read, skipped"},
                                {3, "Radiance HDR image; only PNG and JPEG are read, skipped"}}) {
    EXPECT_TRUE(recording.LoadImage(i, &why).empty());
    EXPECT_EQ(why, fmt::format("{}: {}", ImagePath(i), what));
  }
  EXPECT_FALSE(recording.LoadImage(4, &why).empty());
}

TEST_F(EurocTest, WhatIsNoFileIsRefusedByName) {
  for (const char* file : {"imu0/data.csv", "imu0/sensor.yaml", "cam0/sensor.yaml"}) {
    const std::string text = Text(file);
    const std::string path = root_ + "/mav0/" + file;
    fs::remove(path);
    ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
    EXPECT_EQ(Complaint(), path + ": cannot be opened: it is a FIFO; only regular files are read");
    fs::remove(path);
    fs::create_symlink(fs::path(path).filename(), path);
    EXPECT_EQ(Complaint(), path + ": cannot be opened: Too many levels of symbolic links");
    fs::remove(path);
    Write(file, text);
  }
  fs::remove(ImagePath(3));
  fs::create_symlink(fs::path(ImagePath(3)).filename(), ImagePath(3));
  EXPECT_THAT(EurocRecording(root_).warnings(), Contains(HasSubstr("is missing")));
  fs::create_symlink("loop", root_ + "/loop");
  root_ += "/loop";
  EXPECT_THAT(Complaint(), HasSubstr("/loop: there is no such recording folder: Too many levels"));
}

TEST_F(EurocTest, StampsADayFromTheOthersAreDropped) {
  const std::string imu = Text("imu0/data.csv"), cam = Text("cam0/data.csv");
  const std::string values = ",0,0,0,0,0,9.81\n";
  Write("imu0/data.csv", imu + "9223372036854775807" + values + "-9223372036854775808" + values);
  Write("cam0/data.csv", cam + fmt::format("9223372036854775807,{}.png\n", kStart));
  const EurocRecording recording(root_);
  EXPECT_EQ(recording.imu().size(), 200U);
  EXPECT_EQ(recording.images().size(), 10U);
  EXPECT_THAT(recording.warnings(),
              ElementsAre(HasSubstr("cam0/data.csv: 1 rows are stamped more than a day from"),
                          HasSubstr("imu0/data.csv: 2 rows are stamped more than a day from")));
}

TEST_F(EurocTest, LeversAreMetres) {
  for (const char* file : {"cam0/sensor.yaml", "imu0/sensor.yaml"}) {
    const std::string yaml = Text(file);
    for (const char* far : {"1e30", "-11"}) {
      std::string moved = yaml;
      moved.replace(moved.find("1,0,0,0,"), 8, fmt::format("1,0,0,{},", far));
      Write(file, moved);
      EXPECT_THAT(Complaint(), HasSubstr(fmt::format("{}: the translation in 'T_BS' is ", file)));
      EXPECT_THAT(Complaint(), HasSubstr(" m long; at most 10 are plausible"));
    }
    std::string moved = yaml;
    moved.replace(moved.find("1,0,0,0,"), 8, file[0] == 'c' ? "1,0,0,6," : "1,0,0,-6,");
    Write(file, moved);
  }
  EXPECT_THAT(Complaint(), HasSubstr("mav0: the camera is 12 m from the body; at most 10 are"));
  WriteCamera("radtan", "1e30, 24");
  EXPECT_THAT(Complaint(),
              HasSubstr("'resolution' must be whole pixels, at most 1000000, not 1e+30"));
}

TEST_F(EurocTest, TruncatedImuCsvLosesOnlyItsLastRow) {
  const std::string imu = Text("imu0/data.csv");
  for (const size_t cut : {1U, 3U, 20U, 40U}) {
    Write("imu0/data.csv", imu.substr(0, imu.size() - cut));
    const EurocRecording recording(root_);
    EXPECT_EQ(recording.imu().size(), 199U) << cut;
    EXPECT_THAT(recording.warnings(), Contains(HasSubstr("may be cut off; row dropped")));
  }
}

TEST_F(EurocTest, MalformedImuRows) {
  const std::string imu = Text("imu0/data.csv");
  Write("imu0/data.csv", imu + "nonsense\n1403636584763555584000000,1,2,3,4,5,6\n" +
                             fmt::format("{},nan,0,0,0,0,0\n", kStart + 990000000));
  const EurocRecording recording(root_);
  EXPECT_EQ(recording.imu().size(), 200U);
  EXPECT_THAT(recording.warnings(), Contains(HasSubstr("imu0/data.csv:202: not")));
  EXPECT_EQ(recording.warnings().size(), 3U);
  Write("imu0/data.csv", "1,2,3,4\n5,6,7,8\n");
  EXPECT_THAT(Complaint(), HasSubstr("expected: nanoseconds, gyro"));
}

TEST_F(EurocTest, ImuGapAndImagesOutsideTheImu) {
  std::string imu;
  for (int64_t i = 10; i < 180; ++i) {
    if (i < 50 || i > 60) {
      imu += fmt::format("{},0.1,0.2,0.3,0,0,9.81\n", kStart + i * 5000000);
    }
  }
  Write("imu0/data.csv", imu);
  const EurocRecording recording(root_);
  EXPECT_EQ(recording.images().size(), 9U);
  EXPECT_THAT(recording.warnings(), Contains(HasSubstr("1 of 10 images are outside")));
  EXPECT_THAT(recording.warnings(), Contains(HasSubstr("imu0/data.csv: gap of 0.060 s")));
  Write("imu0/data.csv", "1000,0,0,0,0,0,0\n2000,0,0,0,0,0,0\n");
  EXPECT_THAT(Complaint(), HasSubstr("no image lies within the IMU's time"));
}

TEST_F(EurocTest, GroundTruthMayBeAbsentOrUnreadable) {
  Write("state_groundtruth_estimate0/data.csv", "rubbish,rubbish\nrubbish\n");
  const EurocRecording unreadable(root_);
  EXPECT_THAT(unreadable.ground_truth(), IsEmpty());
  EXPECT_THAT(unreadable.warnings(), Contains(HasSubstr("going on without ground truth")));
  fs::remove_all(root_ + "/mav0/state_groundtruth_estimate0");
  const EurocRecording absent(root_);
  EXPECT_THAT(absent.ground_truth(), IsEmpty());
  EXPECT_THAT(absent.warnings(), IsEmpty());
}

}  // namespace
}  // namespace pangea

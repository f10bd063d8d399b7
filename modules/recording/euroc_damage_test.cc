// Recordings with mistakes in their files: what is dropped, skipped or refused, and how it is
// named.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
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

TEST_F(EurocTest, StampsInMicrosecondsAreNamed) {
  const std::string columns = "#timestamp [ns],filename\n";
  std::string nanoseconds, microseconds;
  for (int i = 9; i >= 0; --i) {  // neither the order nor repeats matter
    nanoseconds += ImageRow(i) + ImageRow(i);
    microseconds += fmt::format("{},{}.png\n", kEurocTestStart_ns / 1000 + i * 50'000,
                                kEurocTestStart_ns + i * int64_t{50000000});
  }
  Write("cam0/data.csv", columns + microseconds);
  EXPECT_THAT(Complaint(), HasSubstr("cam0/data.csv: its images are 50 us apart: are the stamps "
                                     "nanoseconds?"));
  Write("cam0/data.csv", columns + nanoseconds);
  EXPECT_EQ(Complaint(), "");
}

TEST_F(EurocTest, WhatNoSensorShowsIsDropped) {
  Write("imu0/data.csv", Text("imu0/data.csv") +
                             fmt::format("{},1e30,0,0,0,0,9.81\n", kEurocTestStart_ns + 905000000));
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
  EXPECT_EQ(recording.images()[0].stamp_ns, kEurocTestStart_ns);
  EXPECT_THAT(recording.warnings(), Contains(HasSubstr("1 rows out of order; sorted")));
  EXPECT_THAT(recording.warnings(), Contains(HasSubstr("1 rows with a stamp already seen")));
}

TEST_F(EurocTest, MissingImagesAreDroppedAndGapsNamed) {
  for (const int i : {4, 5, 6}) {
    fs::remove(ImagePath(i));
  }
  const EurocRecording recording(root_);
  EXPECT_EQ(recording.images().size(), 7U);
  EXPECT_THAT(recording.warnings(),
              Contains(HasSubstr("data.csv:6: image " + ImagePath(4) + " is missing")));
  EXPECT_THAT(recording.warnings(), Contains(HasSubstr("gap of 0.200 s after 0.150 s")));
  fs::remove_all(root_ + "/mav0/cam0/data");
  EXPECT_THAT(Complaint(), HasSubstr("none of its 10 images"));
}

TEST_F(EurocTest, ImagesAreFoundHoweverTheyAreNamed) {
  for (const auto& [before, after] : {std::pair<std::string, std::string>("\"", "\""),
                                      {"'", "'"},
                                      {"data/", ""},
                                      {"\"data/", "\""},
                                      {"./data/", ""},
                                      {"cam0/data/", ""},
                                      {"mav0/cam0/data/", ""},
                                      {"data\\", ""},
                                      {root_ + "/mav0/cam0/data/", ""}}) {
    std::string cam = "#timestamp [ns],filename\n";
    for (int i = 0; i < 10; ++i) {
      const int64_t ns = kEurocTestStart_ns + i * int64_t{50000000};
      cam += fmt::format("{},{}{}.png{}\n", ns, before, ns, after);
    }
    Write("cam0/data.csv", cam);
    ASSERT_EQ(Complaint(), "") << before;
    const EurocRecording recording(root_);
    EXPECT_THAT(recording.warnings(), IsEmpty()) << before;
    ASSERT_EQ(recording.images().size(), 10U) << before;
    EXPECT_EQ(recording.images()[3].path, ImagePath(3)) << before;
  }
}

TEST_F(EurocTest, AMissingImageIsNamedByWhatWasLookedFor) {
  std::string cam;
  for (int i = 0; i < 10; ++i) {
    cam += fmt::format("{},left/{}.png\n", kEurocTestStart_ns + i * int64_t{50000000}, i);
  }
  Write("cam0/data.csv", cam);
  EXPECT_THAT(Complaint(), HasSubstr("none of its 10 images is in " + root_ + "/mav0/cam0/data; "));
  EXPECT_THAT(Complaint(),
              HasSubstr("the first is not there as " + root_ + "/mav0/cam0/data/left/0.png"));
}

TEST_F(EurocTest, ARateThatIsNotTheImagesIsNamed) {
  const std::string cam0 = Text("cam0/sensor.yaml"), imu0 = Text("imu0/sensor.yaml");
  Write("cam0/sensor.yaml", cam0 + "rate_hz: 20\n");
  EXPECT_THAT(EurocRecording(root_).warnings(), IsEmpty());
  Write("cam0/sensor.yaml", cam0 + "rate_hz: 30\n");
  EXPECT_THAT(
      EurocRecording(root_).warnings(),
      ElementsAre(HasSubstr("cam0/sensor.yaml: states 30 Hz, but by their stamps the rows")));
  Write("cam0/sensor.yaml", cam0);
  Write("imu0/sensor.yaml", imu0.substr(0, imu0.find("rate_hz")) + "rate_hz: 100\n" +
                                imu0.substr(imu0.find("gyroscope_noise")));
  EXPECT_THAT(EurocRecording(root_).warnings(),
              ElementsAre(testing::AllOf(HasSubstr("imu0/sensor.yaml: states 100 Hz, but"),
                                         HasSubstr(" come at 200 Hz"))));
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
  Write("cam0/data.csv", cam + fmt::format("9223372036854775807,{}.png\n", kEurocTestStart_ns));
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
                             fmt::format("{},nan,0,0,0,0,0\n", kEurocTestStart_ns + 990000000));
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
      imu += fmt::format("{},0.1,0.2,0.3,0,0,9.81\n", kEurocTestStart_ns + i * 5000000);
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

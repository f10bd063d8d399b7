// The text files of a recording in EuRoC's format: six parts, separated by form feeds.

#include <array>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "fuzz.h"
#include "recording/euroc.h"
#include "recording/trajectory.h"

namespace pangea::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr std::array kFiles = {"cam0/sensor.yaml",
                               "imu0/sensor.yaml",
                               "cam0/data.csv",
                               "imu0/data.csv",
                               "state_groundtruth_estimate0/data.csv",
                               "state_groundtruth_estimate0/sensor.yaml"};

// Makes the folders with the one image that the corpus' data.csv names.
fs::path MakeFolders() {
  fs::path mav0 = ScratchFolder() / "recording" / "mav0";
  for (const char* folder : {"cam0/data", "imu0", "state_groundtruth_estimate0"}) {
    fs::create_directories(mav0 / folder);
  }
  cv::imwrite((mav0 / "cam0/data/1000000000.png").string(),
              cv::Mat(24, 32, CV_8UC1, cv::Scalar(9)));
  return mav0;
}

void Read(const fs::path& mav0) {
  const EurocRecording recording(mav0.string());
  Require(!recording.images().empty() && !recording.imu().empty(), "a recording holds something");
  Require(!recording.camera().Invalid(), "a recording's camera is valid");
  std::string why;
  recording.LoadImage(0, &why);
}

}  // namespace
}  // namespace pangea::fuzz

static int FuzzRecording(const uint8_t* data, size_t size) {
  using namespace pangea;
  static const fuzz::fs::path mav0 = fuzz::MakeFolders();
  Bytes rest(data, size);
  for (const char* file : fuzz::kFiles) {
    size_t end = 0;
    while (end < rest.size() && rest[end] != '\f') {
      ++end;
    }
    fuzz::WriteFile(mav0 / file, rest.first(end));
    rest = rest.subspan(std::min(end + 1, rest.size()));
  }
  const auto try_to = [](const auto& read) {
    try {
      read();
    } catch (const std::runtime_error& error) {
      fuzz::Require(*error.what() != 0, "a refusal has a reason");
    }
  };
  std::vector<std::string> warnings;
  try_to([&] { fuzz::Read(mav0); });
  try_to([&] { ReadTrajectory((mav0 / fuzz::kFiles[4]).string(), &warnings); });
  try_to([&] { FirstImageUtimeOf(mav0.string()); });
  return 0;
}
static const pangea::fuzz::Target kRecording("recording", FuzzRecording);

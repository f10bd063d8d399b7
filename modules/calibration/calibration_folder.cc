#include "calibration/calibration_folder.h"

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>

#include "calibration/priors.h"
#include "calibration/sensor_yaml.h"
#include "files/csv.h"
#include "files/make_folder.h"
#include "files/text_file.h"
#include "recording/euroc_calibration.h"
#include "recording/grey_image.h"

namespace pangea::calibration {
namespace {

namespace fs = std::filesystem;

// Noise of a typical phone, if the recording does not have it.
constexpr ImuNoise kPhoneNoise{.gyro_noise_density = 5e-4,
                               .gyro_random_walk = 5e-5,
                               .accel_noise_density = 5e-3,
                               .accel_random_walk = 5e-4,
                               .rate_hz = 200};

fs::path Mav0Of(const std::string& folder) {
  fs::path mav0 =
      fs::exists(fs::path(folder) / "mav0") ? fs::path(folder) / "mav0" : fs::path(folder);
  if (!fs::exists(mav0 / "cam0") || !fs::exists(mav0 / "imu0")) {
    throw std::runtime_error(fmt::format(
        "{}: not a recording in EuRoC's format; it must hold mav0/cam0 and mav0/imu0", folder));
  }
  return mav0;
}

cv::Size SizeOfImages(const fs::path& mav0) {
  const std::string csv = (mav0 / "cam0/data.csv").string();
  for (const CsvRow& row : ReadCsv(csv)) {
    const fs::path image = mav0 / "cam0/data" / (row.fields.size() > 1 ? row.fields[1] : "");
    if (!fs::is_regular_file(image)) {
      continue;
    }
    const std::string bytes = ReadTextFile(image.string());
    const auto* begin = reinterpret_cast<const uint8_t*>(bytes.data());
    const ImageHeader header = ReadImageHeader({begin, bytes.size()});
    if (header.size.area() > 0) {
      return header.size;
    }
  }
  throw std::runtime_error(fmt::format("{}: no PNG or JPEG that it names can be read", csv));
}

EurocImuCalibration ImuOf(const fs::path& mav0) {
  const auto file = FindEurocCalibrationFile(mav0.string(), "imu0");
  return file ? ReadEurocImuCalibration(*file) : EurocImuCalibration{kPhoneNoise, {}};
}

void LinkEntries(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  for (const fs::directory_entry& entry : fs::directory_iterator(from)) {
    const fs::path name = entry.path().filename();
    if (name != "sensor.yaml" && name != "cam0" && name != "imu0") {
      fs::create_symlink(fs::absolute(entry.path()), to / name);
    }
  }
}

}  // namespace

CalibrationFolder::CalibrationFolder(const std::string& recording, const std::string& out)
    : out_(WithoutSlash(out).string()), part_(out_ + ".part") {
  if (fs::exists(out_)) {
    throw std::runtime_error(fmt::format("{}: exists already; give another --out", out_));
  }
  if (fs::exists(part_)) {
    throw std::runtime_error(
        fmt::format("{}: is there already, of a run that goes on or was killed; remove it, or give "
                    "another --out",
                    part_));
  }
  const fs::path from = Mav0Of(recording), to = fs::path(part_) / "mav0";
  recording_mav0_ = from.string();
  const cv::Size size = SizeOfImages(from);
  const EurocImuCalibration imu = ImuOf(from);
  T_s_body_ = imu.T_s_body;
  Result nothing_known;
  nothing_known.sigma.setConstant(0.1);  // the values written must be readable
  nothing_known.parameters.camera = GuessedCamera(size.width, size.height);
  try {
    LinkEntries(from, to);
    LinkEntries(from / "cam0", to / "cam0");
    LinkEntries(from / "imu0", to / "imu0");
    WriteSensorYaml(nothing_known, imu.noise);
  } catch (...) {
    Remove();
    throw;
  }
}

CalibrationFolder::~CalibrationFolder() {
  if (!finished_) {
    Remove();
  }
}

void CalibrationFolder::WriteSensorYaml(const Result& result, const ImuNoise& noise) const {
  const fs::path mav0 = fs::path(part_) / "mav0";
  const double rate_hz = result.image_rate_hz > 0 ? result.image_rate_hz : 30;
  WriteTextFile((mav0 / "cam0/sensor.yaml").string(), CameraYaml(result, rate_hz, T_s_body_));
  WriteTextFile((mav0 / "imu0/sensor.yaml").string(), ImuYaml(result, noise, T_s_body_));
}

void CalibrationFolder::Remove() {
  std::error_code error;
  fs::remove_all(part_, error);
}

std::string CalibrationFolder::AboutTheRecording(std::string text) const {
  const std::string copy = part_ + "/mav0";
  for (size_t at = 0; (at = text.find(copy, at)) != std::string::npos;
       at += recording_mav0_.size()) {
    text.replace(at, copy.size(), recording_mav0_);
  }
  return text;
}

void CalibrationFolder::Finish(const Result& result, const ImuNoise& noise,
                               const std::string& summary) {
  WriteSensorYaml(result, noise);
  WriteTextFile((fs::path(part_) / "calibration.txt").string(), summary);
  fs::rename(part_, out_);
  finished_ = true;
}

}  // namespace pangea::calibration

#include "calibration/calibration_folder.h"

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>

#include "files/csv.h"
#include "files/text_file.h"
#include "recording/euroc_calibration.h"
#include "recording/grey_image.h"

namespace pangea::calibration {
namespace {

namespace fs = std::filesystem;

// Of a phone's sensor, where nobody says better.
constexpr ImuNoise kPhoneNoise{.gyro_noise_density = 5e-4,
                               .gyro_random_walk = 5e-5,
                               .accel_noise_density = 5e-3,
                               .accel_random_walk = 5e-4,
                               .rate_hz = 200};
constexpr double kGuessedField = 1.13;  // rad
constexpr double kTranslationSigma_m = 0.05;

fs::path Mav0Of(const std::string& folder) {
  const fs::path mav0 =
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

ImuNoise NoiseOf(const fs::path& mav0) {
  const std::string yaml = (mav0 / "imu0/sensor.yaml").string();
  return Exists(yaml) ? ReadEurocImuCalibration(yaml).noise : kPhoneNoise;
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

// T_BS as EuRoC writes it.
std::string Matrix(const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d R = q.toRotationMatrix();
  std::string data;
  for (int row = 0; row < 3; ++row) {
    data += fmt::format("{:.9f}, {:.9f}, {:.9f}, 0, ", R(row, 0), R(row, 1), R(row, 2));
  }
  return fmt::format("T_BS:\n  cols: 4\n  rows: 4\n  data: [{}0, 0, 0, 1]\n", data);
}

std::string List(const Eigen::Vector3d& v) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v.x(), v.y(), v.z());
}

}  // namespace

std::string CameraYaml(const Result& result, double rate_hz) {
  const CameraModel& c = result.parameters.camera;
  const Tangent& sigma = result.sigma;
  const bool fisheye = c.kind == CameraModel::Kind::kEquidistant;
  std::string text = "sensor_type: camera\n" + Matrix(c.T_body_cam.q);
  text += fmt::format("rotation_sigma: {}  # rad, about the body's axes\n",
                      List(sigma.segment<3>(kRotation)));
  text += fmt::format("translation_sigma: {}  # m: not estimated\n", kTranslationSigma_m);
  text += fmt::format("rate_hz: {:.4g}\nresolution: [{}, {}]\ncamera_model: pinhole\n", rate_hz,
                      c.width, c.height);
  text += fmt::format("intrinsics: [{:.3f}, {:.3f}, {:.3f}, {:.3f}]\n", c.fx, c.fy, c.cx, c.cy);
  text += fmt::format("intrinsics_sigma: [{0:.3g}, {0:.3g}, {1:.3g}, {2:.3g}]  # px\n",
                      c.fx * sigma[kLogFocal], sigma[kCentre], sigma[kCentre + 1]);
  text += fmt::format("distortion_model: {}\n", fisheye ? "equidistant" : "radial-tangential");
  text += fmt::format("distortion_coefficients: [{:.6f}, {:.6f}, 0, 0]\n", c.distortion[0],
                      c.distortion[1]);
  text += fmt::format("distortion_sigma: [{:.3g}, {:.3g}]  # of the first two\n",
                      sigma[kDistortion], sigma[kDistortion + 1]);
  text += fmt::format("time_offset_s: {:.6f}  # of the first row: t_imu = t_image + offset\n",
                      c.time_offset_s);
  text += fmt::format("time_offset_sigma: {:.3g}  # of the middle row\n", sigma[kTimeOffset]);
  text += fmt::format("readout_s: {:.6f}\nreadout_sigma: {:.3g}\n", c.readout_s, sigma[kReadout]);
  return text;
}

std::string ImuYaml(const Result& result, const ImuNoise& noise) {
  std::string text = "sensor_type: imu\n" + Matrix(Eigen::Quaterniond::Identity());
  text += fmt::format("rate_hz: {:.4g}\n", noise.rate_hz);
  text += fmt::format("gyroscope_noise_density: {:.6g}\ngyroscope_random_walk: {:.6g}\n",
                      noise.gyro_noise_density, noise.gyro_random_walk);
  text += fmt::format("accelerometer_noise_density: {:.6g}\naccelerometer_random_walk: {:.6g}\n",
                      noise.accel_noise_density, noise.accel_random_walk);
  text += fmt::format("gyroscope_bias: {}  # rad/s\ngyroscope_bias_sigma: {}\n",
                      List(result.parameters.gyro_bias), List(result.sigma.segment<3>(kGyroBias)));
  return text;
}

void WriteSensorYaml(const std::string& out, const Result& result, const ImuNoise& noise) {
  const fs::path mav0 = fs::path(out) / "mav0";
  const double rate_hz = result.image_rate_hz > 0 ? result.image_rate_hz : 30;
  WriteTextFile((mav0 / "cam0/sensor.yaml").string(), CameraYaml(result, rate_hz));
  WriteTextFile((mav0 / "imu0/sensor.yaml").string(), ImuYaml(result, noise));
}

void MakeFolder(const std::string& recording, const std::string& out) {
  if (fs::exists(out)) {
    throw std::runtime_error(fmt::format("{}: exists already; give another --out", out));
  }
  const fs::path from = Mav0Of(recording), to = fs::path(out) / "mav0";
  const cv::Size size = SizeOfImages(from);
  const ImuNoise noise = NoiseOf(from);
  LinkEntries(from, to);
  LinkEntries(from / "cam0", to / "cam0");
  LinkEntries(from / "imu0", to / "imu0");
  Result nothing_known;
  nothing_known.sigma.setConstant(0.1);  // what is written must be readable
  CameraModel& camera = nothing_known.parameters.camera;
  camera.width = size.width;
  camera.height = size.height;
  camera.cx = 0.5 * (size.width - 1);
  camera.cy = 0.5 * (size.height - 1);
  camera.fx = camera.fy = FocalOf(kGuessedField, camera);
  WriteSensorYaml(out, nothing_known, noise);
}

}  // namespace pangea::calibration

#include "recording/euroc_calibration.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "files/text_file.h"

namespace pangea {
namespace {

[[noreturn]] void Throw(const std::string& file, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}", file, what));
}

// `path` stands for the text in messages.
YAML::Node Load(std::string text, const std::string& path) {
  if (text.starts_with("%YAML:")) {  // OpenCV's spelling of the directive is not YAML
    text.erase(0, text.find('\n'));
  }
  try {
    YAML::Node node = YAML::Load(text);
    if (!node.IsMap()) {
      Throw(path, "holds no keys");
    }
    return node;
  } catch (const YAML::Exception& error) {
    Throw(path, fmt::format("line {}: not YAML: {}", error.mark.line + 1, error.msg));
  }
}

double Number(const YAML::Node& node, const std::string& file, const std::string& key) {
  double value = 0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
    Throw(file, fmt::format("field '{}' must be a finite number", key));
  }
  return value;
}

std::vector<double> Numbers(const YAML::Node& root, const std::string& file, const std::string& key,
                            size_t count) {
  const YAML::Node node = root[key];
  if (!node || !node.IsSequence() || node.size() != count) {
    Throw(file, fmt::format("field '{}' must be a list of {} numbers", key, count));
  }
  std::vector<double> values;
  for (const YAML::Node& item : node) {
    values.push_back(Number(item, file, key));
  }
  return values;
}

Rigid3 Extrinsics(const YAML::Node& root, const std::string& file) {
  const YAML::Node node = root["T_BS"];
  if (!node || !node.IsMap()) {
    Throw(file, "field 'T_BS' (a 4x4 matrix with rows, cols and data) is missing");
  }
  const std::vector<double> m = Numbers(node, file, "data", 16);
  Eigen::Matrix3d R;
  R << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (error > 1e-3 || R.determinant() < 0) {
    Throw(file, fmt::format("the rotation in 'T_BS' is not one (|R R' - I| = {:.2g}, det {:.2g})",
                            error, R.determinant()));
  }
  const Eigen::Vector3d t(m[3], m[7], m[11]);
  if (t.norm() > CameraModel::kMaxLever_m) {
    Throw(file, fmt::format("the translation in 'T_BS' is {:.3g} m long; at most {} are plausible: "
                            "is it in metres?",
                            t.norm(), CameraModel::kMaxLever_m));
  }
  return {Eigen::Quaterniond(R).normalized(), t};
}

CameraModel::Kind Distortion(const YAML::Node& root, const std::string& file) {
  const YAML::Node node = root["distortion_model"];
  const std::string name = node && node.IsScalar() ? node.Scalar() : "";
  if (name == "radial-tangential" || name == "radtan" || name == "plumb_bob") {
    return CameraModel::Kind::kRadtan;
  }
  if (name == "equidistant" || name == "equi") {
    return CameraModel::Kind::kEquidistant;
  }
  Throw(file, fmt::format("'distortion_model: {}' is not known; known: radial-tangential (radtan), "
                          "equidistant",
                          name));
}

double OptionalNumber(const YAML::Node& root, const std::string& file, const std::string& key,
                      double otherwise) {
  const YAML::Node node = root[key];
  return node ? Number(node, file, key) : otherwise;
}

// The share of the read-out that has passed when the row is exposed whose time a stamp plus the
// offset is.
double StampedRow(const YAML::Node& root, const std::string& file, const std::string& otherwise) {
  const YAML::Node node = root["stamp_row"];
  const std::string row = !node ? otherwise : node.IsScalar() ? node.Scalar() : "";
  for (const auto& [name, share] :
       {std::pair("first", 0.0), std::pair("middle", 0.5), std::pair("last", 1.0)}) {
    if (row == name) {
      return share;
    }
  }
  Throw(file, fmt::format("'stamp_row: {}' is not known; known: first, middle, last", row));
}

// Of the first row. Kalibr fits one time to a whole image, which is that of its middle row.
double TimeOffset(const YAML::Node& root, const std::string& file, double readout_s) {
  const bool is_ours = !root["timeshift_cam_imu"] || root["time_offset_s"];
  const double offset_s =
      OptionalNumber(root, file, is_ours ? "time_offset_s" : "timeshift_cam_imu", 0);
  return offset_s - StampedRow(root, file, is_ours ? "first" : "middle") * readout_s;
}

}  // namespace

CameraModel ReadEurocCamera(const std::string& sensor_yaml) {
  return ParseEurocCamera(ReadTextFile(sensor_yaml), sensor_yaml);
}

CameraModel ParseEurocCamera(const std::string& text, const std::string& sensor_yaml) {
  const YAML::Node root = Load(text, sensor_yaml);
  const YAML::Node model = root["camera_model"];
  if (model && (!model.IsScalar() || model.Scalar() != "pinhole")) {
    Throw(sensor_yaml, "'camera_model' must be pinhole");
  }
  CameraModel camera;
  camera.kind = Distortion(root, sensor_yaml);
  const std::vector<double> size = Numbers(root, sensor_yaml, "resolution", 2);
  for (const double pixels : size) {
    if (!(pixels >= 1 && pixels <= 1e6)) {
      Throw(sensor_yaml, fmt::format("field 'resolution' is out of range: {} pixels", pixels));
    }
  }
  camera.width = static_cast<int>(size[0]);
  camera.height = static_cast<int>(size[1]);
  const std::vector<double> k = Numbers(root, sensor_yaml, "intrinsics", 4);
  camera.fx = k[0];
  camera.fy = k[1];
  camera.cx = k[2];
  camera.cy = k[3];
  const std::vector<double> d = Numbers(root, sensor_yaml, "distortion_coefficients", 4);
  camera.distortion << d[0], d[1], d[2], d[3];
  camera.T_body_cam = Extrinsics(root, sensor_yaml);
  camera.readout_s = OptionalNumber(root, sensor_yaml, "readout_s", 0);
  camera.time_offset_s = TimeOffset(root, sensor_yaml, camera.readout_s);
  if (const auto invalid = camera.Invalid()) {
    Throw(sensor_yaml, *invalid);
  }
  return camera;
}

std::optional<CalibrationSigmas> ReadEurocCalibrationSigmas(const std::string& sensor_yaml) {
  return ParseEurocCalibrationSigmas(ReadTextFile(sensor_yaml), sensor_yaml);
}

std::optional<CalibrationSigmas> ParseEurocCalibrationSigmas(const std::string& text,
                                                             const std::string& sensor_yaml) {
  const YAML::Node root = Load(text, sensor_yaml);
  // The largest of `count` numbers from `first` on of a list of `size`, or of a number alone (0).
  const auto read = [&](const char* key, size_t size, size_t first, size_t count, double unit,
                        double* sigma) {
    if (!root[key]) {
      return false;
    }
    const std::vector<double> values = size > 0 ? Numbers(root, sensor_yaml, key, size)
                                                : std::vector{Number(root[key], sensor_yaml, key)};
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first);
    *sigma = *std::max_element(begin, begin + static_cast<std::ptrdiff_t>(count)) / unit;
    if (!(*sigma > 0 && *sigma < 1)) {
      Throw(sensor_yaml,
            fmt::format("field '{}' must be above 0 and plausible, not {}", key, *sigma * unit));
    }
    return true;
  };
  const double focal_px = Numbers(root, sensor_yaml, "intrinsics", 4)[0];
  CalibrationSigmas sigmas;
  bool is_any = read("rotation_sigma", 3, 0, 3, 1, &sigmas.rotation);
  is_any |= read("translation_sigma", 0, 0, 1, 1, &sigmas.position_m);
  is_any |= read("time_offset_sigma", 0, 0, 1, 1, &sigmas.time_offset_s);
  is_any |= read("intrinsics_sigma", 4, 0, 2, focal_px, &sigmas.focal);
  is_any |= read("intrinsics_sigma", 4, 2, 2, focal_px, &sigmas.centre);
  return is_any ? std::optional(sigmas) : std::nullopt;
}

EurocImuCalibration ReadEurocImuCalibration(const std::string& sensor_yaml) {
  return ParseEurocImuCalibration(ReadTextFile(sensor_yaml), sensor_yaml);
}

EurocImuCalibration ParseEurocImuCalibration(const std::string& text,
                                             const std::string& sensor_yaml) {
  const YAML::Node root = Load(text, sensor_yaml);
  EurocImuCalibration calibration;
  calibration.T_s_body = Extrinsics(root, sensor_yaml);
  ImuNoise& noise = calibration.noise;
  const std::pair<const char*, double*> fields[] = {
      {"gyroscope_noise_density", &noise.gyro_noise_density},
      {"gyroscope_random_walk", &noise.gyro_random_walk},
      {"accelerometer_noise_density", &noise.accel_noise_density},
      {"accelerometer_random_walk", &noise.accel_random_walk},
      {"rate_hz", &noise.rate_hz}};
  for (const auto& [key, value] : fields) {
    const YAML::Node node = root[key];
    if (!node) {
      Throw(sensor_yaml, fmt::format("field '{}' is missing", key));
    }
    *value = Number(node, sensor_yaml, key);
    if (!(*value > 0)) {
      Throw(sensor_yaml, fmt::format("field '{}' must be above 0, not {}", key, *value));
    }
  }
  for (const auto& [key, value] : {std::pair("gyroscope_scale_sigma", &noise.gyro_scale_sigma),
                                   std::pair("accelerometer_scale_sigma", &noise.accel_scale_sigma),
                                   std::pair("axes_sigma", &noise.axes_sigma)}) {
    *value = OptionalNumber(root, sensor_yaml, key, *value);
    if (*value < 0) {
      Throw(sensor_yaml, fmt::format("field '{}' must be 0 (exact) or above, not {}", key, *value));
    }
  }
  return calibration;
}

Rigid3 ReadEurocExtrinsics(const std::string& sensor_yaml) {
  if (!Exists(sensor_yaml)) {
    return {};
  }
  const YAML::Node root = Load(ReadTextFile(sensor_yaml), sensor_yaml);
  return root["T_BS"] ? Extrinsics(root, sensor_yaml) : Rigid3();
}

}  // namespace pangea

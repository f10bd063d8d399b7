#include "recording/euroc_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <tuple>
#include <vector>

#include "core/nearest_rotation.h"
#include "files/text_file.h"
#include "recording/sensor_file.h"

namespace pangea {
namespace {

[[noreturn]] void Throw(const std::string& file, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}", file, what));
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
  if (!node) {
    Throw(file, fmt::format("field '{}', a list of {} numbers, is missing", key, count));
  }
  if (!node.IsSequence() || node.size() != count) {
    Throw(file, fmt::format("field '{}' must be a list of {} numbers", key, count));
  }
  std::vector<double> values;
  for (const YAML::Node& item : node) {
    values.push_back(Number(item, file, key));
  }
  return values;
}

// A 4x4 matrix, row by row: EuRoC's `data`, or Kalibr's list of rows.
std::vector<double> Matrix4(const YAML::Node& root, const std::string& file,
                            const std::string& key) {
  const YAML::Node node = root[key];
  if (node && node.IsMap()) {
    return Numbers(node, file, "data", 16);
  }
  if (!node || !node.IsSequence() || node.size() != 4) {
    Throw(file, fmt::format("field '{}' must be a 4x4 matrix", key));
  }
  std::vector<double> values;
  for (const YAML::Node& row : node) {
    for (const YAML::Node& item : row) {
      values.push_back(Number(item, file, key));
    }
  }
  if (values.size() != 16) {
    Throw(file, fmt::format("field '{}' must be a 4x4 matrix", key));
  }
  return values;
}

// Published matrices are rounded to a few digits: the nearest rotation is taken, with a warning if
// the difference may matter.
Eigen::Quaterniond Rotation(const Eigen::Matrix3d& R, const std::string& file,
                            const std::string& key, std::vector<std::string>* warnings) {
  constexpr double kExact = 1e-3;    // |R R' - I|: half of it is an error of 0.03 degrees
  constexpr double kRounded = 1e-2;  // three digits give up to 0.003
  const double error = (R * R.transpose() - Eigen::Matrix3d::Identity()).norm();
  if (R.determinant() < 0) {
    Throw(file, fmt::format("the rotation in '{}' is left-handed (det {:.2g}): one axis has the "
                            "wrong sign, or two are swapped; the third column must be the cross "
                            "product of the first two",
                            key, R.determinant()));
  }
  if (error > kRounded) {
    Throw(file, fmt::format("the rotation in '{}' is not one (|R R' - I| = {:.2g}): its columns "
                            "must have length 1 and right angles; give at least three digits",
                            key, error));
  }
  if (error <= kExact) {
    return Eigen::Quaterniond(R).normalized();
  }
  if (warnings != nullptr) {
    warnings->push_back(
        fmt::format("{}: the rotation in '{}' is rounded (|R R' - I| = {:.2g}); the nearest "
                    "rotation is taken, give more digits if there are any",
                    file, key, error));
  }
  return Eigen::Quaterniond(NearestRotation(R)).normalized();
}

Rigid3 Transform(const YAML::Node& root, const std::string& file, const std::string& key,
                 std::vector<std::string>* warnings) {
  const std::vector<double> m = Matrix4(root, file, key);
  if (Eigen::Vector4d(m[12], m[13], m[14], m[15] - 1).norm() > 1e-6) {
    Throw(file, fmt::format("the last row of '{}' must be 0, 0, 0, 1: is the matrix given column "
                            "by column?",
                            key));
  }
  Eigen::Matrix3d R;
  R << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
  const Eigen::Vector3d t(m[3], m[7], m[11]);
  if (t.norm() > CameraModel::kMaxLever_m) {
    Throw(file, fmt::format("the translation in '{}' is {:.3g} m long; at most {} are plausible: "
                            "is it in metres?",
                            key, t.norm(), CameraModel::kMaxLever_m));
  }
  return {Rotation(R, file, key, warnings), t};
}

// EuRoC's T_BS of a camera, or the inverse of Kalibr's T_cam_imu.
Rigid3 CameraExtrinsics(const YAML::Node& root, const std::string& file,
                        std::vector<std::string>* warnings) {
  if (root["T_BS"]) {
    return Transform(root, file, "T_BS", warnings);
  }
  if (root["T_cam_imu"]) {
    return Transform(root, file, "T_cam_imu", warnings).Inverse();
  }
  Throw(file,
        "field 'T_BS' (body from camera, a 4x4 matrix with rows, cols and data) is missing, "
        "and Kalibr's 'T_cam_imu' too: a calibration of the camera alone is not enough");
}

CameraModel::Kind Distortion(const YAML::Node& root, const std::string& file) {
  const YAML::Node node = root["distortion_model"];
  if (!node) {
    Throw(file, "field 'distortion_model' is missing; known: radial-tangential, equidistant");
  }
  const std::string name = node.IsScalar() ? node.Scalar() : "";
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

// Four coefficients: k1, k2, p1, p2, or those of the equidistant model. A fifth, k3, must be 0.
std::vector<double> Coefficients(const YAML::Node& root, const std::string& file) {
  const std::string key = root["distortion_coeffs"] ? "distortion_coeffs"  // Kalibr's name
                                                    : "distortion_coefficients";
  if (root[key] && root[key].size() == 5) {
    std::vector<double> values = Numbers(root, file, key, 5);
    if (values.back() != 0) {
      Throw(file, fmt::format("field '{}' has a fifth number, k3 = {}; the lens model has four: "
                              "calibrate with k3 held at 0, or as equidistant",
                              key, values.back()));
    }
    values.pop_back();
    return values;
  }
  return Numbers(root, file, key, 4);
}

double OptionalNumber(const YAML::Node& root, const std::string& file, const std::string& key,
                      double otherwise) {
  const YAML::Node node = root[key];
  return node ? Number(node, file, key) : otherwise;
}

// A time stamp plus the time offset is the exposure time of one row. Returns the share of the
// read-out that has passed at that row.
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

// Kalibr's first IMU is the body.
bool IsKalibrImu(const YAML::Node& root) { return !root["rate_hz"] && root["update_rate"]; }

// The time offset of the first row. Kalibr fits one time to a whole image: that of its middle row.
double TimeOffset(const YAML::Node& root, const std::string& file, double readout_s) {
  const bool is_ours = !root["timeshift_cam_imu"] || root["time_offset_s"];
  const double offset_s =
      OptionalNumber(root, file, is_ours ? "time_offset_s" : "timeshift_cam_imu", 0);
  return offset_s - StampedRow(root, file, is_ours ? "first" : "middle") * readout_s;
}

}  // namespace

std::optional<std::string> FindEurocCalibrationFile(const std::string& mav0,
                                                    const std::string& sensor) {
  std::string euroc = fmt::format("{}/{}/sensor.yaml", mav0, sensor);
  std::error_code error;
  if (std::filesystem::symlink_status(euroc, error).type() !=
      std::filesystem::file_type::not_found) {
    return euroc;
  }
  std::string tum_vi =
      fmt::format("{}/../dso/{}", mav0, sensor == "cam0" ? "camchain.yaml" : "imu_config.yaml");
  return Exists(tum_vi) ? std::optional(std::move(tum_vi)) : std::nullopt;
}

std::string EurocCalibrationFile(const std::string& mav0, const std::string& sensor) {
  if (auto file = FindEurocCalibrationFile(mav0, sensor)) {
    return *std::move(file);
  }
  Throw(fmt::format("{}/{}/sensor.yaml", mav0, sensor),
        fmt::format("there is no such file. Kalibr's {} serves under that name, and "
                    "pangea-calibrate makes one from the recording",
                    sensor == "cam0" ? "camchain-imucam.yaml" : "imu.yaml"));
}

CameraModel ReadEurocCamera(const std::string& sensor_yaml, std::vector<std::string>* warnings) {
  return ParseEurocCamera(ReadTextFile(sensor_yaml), sensor_yaml, warnings);
}

CameraModel ParseEurocCamera(const std::string& text, const std::string& sensor_yaml,
                             std::vector<std::string>* warnings) {
  const YAML::Node root = LoadSensorFile(text, sensor_yaml, "cam0");
  const YAML::Node model = root["camera_model"];
  if (model && (!model.IsScalar() || model.Scalar() != "pinhole")) {
    Throw(sensor_yaml,
          "'camera_model' must be pinhole; for a wide lens with 'distortion_model: "
          "equidistant'");
  }
  CameraModel camera;
  camera.kind = Distortion(root, sensor_yaml);
  const std::vector<double> size = Numbers(root, sensor_yaml, "resolution", 2);
  for (const double pixels : size) {
    if (!(pixels >= 1 && pixels <= 1e6 && pixels == std::floor(pixels))) {
      Throw(
          sensor_yaml,
          fmt::format("field 'resolution' must be whole pixels, at most 1000000, not {}", pixels));
    }
  }
  camera.width = static_cast<int>(size[0]);
  camera.height = static_cast<int>(size[1]);
  const std::vector<double> k = Numbers(root, sensor_yaml, "intrinsics", 4);
  camera.fx = k[0];
  camera.fy = k[1];
  camera.cx = k[2];
  camera.cy = k[3];
  const std::vector<double> d = Coefficients(root, sensor_yaml);
  camera.distortion << d[0], d[1], d[2], d[3];
  camera.T_body_cam = CameraExtrinsics(root, sensor_yaml, warnings);
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
  const YAML::Node root = LoadSensorFile(text, sensor_yaml, "cam0");
  // The value of `key` is a list of `size` numbers, or one number if `size` is 0. Reads the largest
  // of `count` numbers from `first` on, divided by `unit`.
  const auto read = [&](const char* key, size_t size, size_t first, size_t count, double unit,
                        double* sigma) {
    if (!root[key]) {
      return false;
    }
    const std::vector<double> values = size > 0 ? Numbers(root, sensor_yaml, key, size)
                                                : std::vector{Number(root[key], sensor_yaml, key)};
    *sigma = 0;
    for (size_t i = first; i < first + count; ++i) {
      if (!(values[i] >= 0 && values[i] < unit)) {
        Throw(sensor_yaml, fmt::format("field '{}' must be 0 or above, and below {:.4g}, not {}",
                                       key, unit, values[i]));
      }
      *sigma = std::max(*sigma, values[i] / unit);
    }
    if (*sigma == 0) {
      Throw(sensor_yaml, fmt::format("field '{}' must be above 0: nothing is known exactly", key));
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
  is_any |= read("distortion_sigma", 2, 0, 2, 1, &sigmas.distortion);
  return is_any ? std::optional(sigmas) : std::nullopt;
}

EurocImuCalibration ReadEurocImuCalibration(const std::string& sensor_yaml,
                                            std::vector<std::string>* warnings) {
  return ParseEurocImuCalibration(ReadTextFile(sensor_yaml), sensor_yaml, warnings);
}

EurocImuCalibration ParseEurocImuCalibration(const std::string& text,
                                             const std::string& sensor_yaml,
                                             std::vector<std::string>* warnings) {
  const YAML::Node root = LoadSensorFile(text, sensor_yaml, "imu0");
  EurocImuCalibration calibration;
  const bool is_kalibr = IsKalibrImu(root);
  if (!is_kalibr) {
    calibration.T_s_body = Transform(root, sensor_yaml, "T_BS", warnings);
  }
  ImuNoise& noise = calibration.noise;
  // Values are in SI units; those beyond the bounds are probably in another unit.
  const std::tuple<const char*, double*, double> fields[] = {
      {"gyroscope_noise_density", &noise.gyro_noise_density, 10},
      {"gyroscope_random_walk", &noise.gyro_random_walk, 10},
      {"accelerometer_noise_density", &noise.accel_noise_density, 100},
      {"accelerometer_random_walk", &noise.accel_random_walk, 100},
      {is_kalibr ? "update_rate" : "rate_hz", &noise.rate_hz, 1e5}};
  for (const auto& [key, value, most] : fields) {
    const YAML::Node node = root[key];
    if (!node) {
      Throw(sensor_yaml, fmt::format("field '{}' is missing", key));
    }
    *value = Number(node, sensor_yaml, key);
    if (!(*value > 0 && *value <= most)) {
      Throw(sensor_yaml,
            fmt::format("field '{}' must be above 0 and at most {}, not {}", key, most, *value));
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

Rigid3 ReadEurocExtrinsics(const std::string& sensor_yaml, std::vector<std::string>* warnings) {
  if (!Exists(sensor_yaml)) {
    return {};
  }
  const YAML::Node root = LoadSensorFile(ReadTextFile(sensor_yaml), sensor_yaml, "imu0");
  return root["T_BS"] && !IsKalibrImu(root) ? Transform(root, sensor_yaml, "T_BS", warnings)
                                            : Rigid3();
}

}  // namespace pangea

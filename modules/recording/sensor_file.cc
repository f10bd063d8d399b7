#include "recording/sensor_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "files/text_file.h"
#include "options/nearest_word.h"

namespace pangea {
namespace {

const std::vector<std::string> kCameraFields = {"T_BS",
                                                "T_cam_imu",
                                                "camera_model",
                                                "distortion_coefficients",
                                                "distortion_coeffs",
                                                "distortion_model",
                                                "distortion_sigma",
                                                "intrinsics",
                                                "intrinsics_sigma",
                                                "readout_s",
                                                "resolution",
                                                "rotation_sigma",
                                                "stamp_row",
                                                "time_offset_s",
                                                "time_offset_sigma",
                                                "timeshift_cam_imu",
                                                "translation_sigma"};
const std::vector<std::string> kImuFields = {"T_BS",
                                             "accelerometer_noise_density",
                                             "accelerometer_random_walk",
                                             "accelerometer_scale_sigma",
                                             "axes_sigma",
                                             "gyroscope_noise_density",
                                             "gyroscope_random_walk",
                                             "gyroscope_scale_sigma",
                                             "rate_hz",
                                             "update_rate"};
const std::set<std::string> kForPeople = {
    "T_cn_cnm1", "T_i_b",   "cam_overlaps",  "comment",  "gyroscope_bias", "gyroscope_bias_sigma",
    "model",     "rate_hz", "readout_sigma", "rostopic", "time_offset",    "sensor_type"};

[[noreturn]] void Refuse(const std::string& path, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}", path, what));
}

void RefuseRepeated(const YAML::Node& fields, const std::string& path) {
  std::set<std::string> seen;
  for (const auto& field : fields) {
    const auto name = field.first.IsScalar() ? field.first.Scalar() : "";
    if (!name.empty() && !seen.insert(name).second) {
      Refuse(path, fmt::format("field '{}' is given twice; keep one", name));
    }
  }
}

bool IsKalibrSensor(const std::string& name, const YAML::Node& value) {
  return value.IsMap() && name.size() > 3 && (name.starts_with("cam") || name.starts_with("imu")) &&
         std::all_of(name.begin() + 3, name.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

YAML::Node LoadSensorFile(std::string text, const std::string& path, const std::string& sensor) {
  if (text.starts_with("%YAML:")) {  // OpenCV's spelling of the directive is not YAML
    text.erase(0, text.find('\n'));
  }
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    Refuse(path, fmt::format("line {}: not YAML: {}", error.mark.line + 1, error.msg));
  }
  if (!root.IsMap()) {
    Refuse(path, "holds no keys");
  }
  RefuseRepeated(root, path);
  std::string others;
  for (const auto& field : root) {
    const auto name = field.first.IsScalar() ? field.first.Scalar() : "";
    if (IsKalibrSensor(name, field.second)) {
      if (name == sensor) {
        RefuseRepeated(field.second, path);
        return field.second;
      }
      others += others.empty() ? name : ", " + name;
    }
  }
  if (!others.empty()) {
    Refuse(path, fmt::format("no sensor '{}' in it; it has {}: rename the one that is meant",
                             sensor, others));
  }
  return root;
}

std::vector<std::string> UnreadFields(const std::string& path, const std::string& sensor) {
  const std::vector<std::string>& known = sensor == "cam0" ? kCameraFields : kImuFields;
  const YAML::Node fields = LoadSensorFile(ReadTextFile(path), path, sensor);
  std::vector<std::string> warnings;
  for (const auto& field : fields) {
    const auto name = field.first.IsScalar() ? field.first.Scalar() : "";
    if (std::find(known.begin(), known.end(), name) == known.end() && !kForPeople.contains(name)) {
      const auto meant = NearestWord(name, known);
      warnings.push_back(fmt::format("{}: field '{}' is not known, and not read{}", path, name,
                                     meant ? fmt::format("; did you mean '{}'?", *meant) : ""));
    }
  }
  if (fields["time_offset_s"] && fields["timeshift_cam_imu"]) {
    warnings.push_back(fmt::format(
        "{}: of 'time_offset_s' and 'timeshift_cam_imu' only the first is read; keep one", path));
  }
  return warnings;
}

std::optional<double> StatedRate(const std::string& path, const std::string& sensor) {
  const YAML::Node fields = LoadSensorFile(ReadTextFile(path), path, sensor);
  double rate_hz = 0;
  for (const char* key : {"rate_hz", "update_rate"}) {
    const YAML::Node node = fields[key];
    if (node && node.IsScalar() && YAML::convert<double>::decode(node, rate_hz) && rate_hz > 0) {
      return rate_hz;
    }
  }
  return std::nullopt;
}

}  // namespace pangea

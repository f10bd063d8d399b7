#pragma once

// Parses a sensor.yaml: EuRoC's with one sensor, or Kalibr's with several sensors by name.

#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>
#include <vector>

namespace pangea {

// The fields of "cam0" or "imu0". Throws std::runtime_error with `path` if the text is not YAML,
// has a field twice, or has only other sensors.
YAML::Node LoadSensorFile(std::string text, const std::string& path, const std::string& sensor);

// A warning for each field of the file that nothing reads, with the field that was probably meant.
// There is no warning for fields that EuRoC and Kalibr write for people.
std::vector<std::string> UnreadFields(const std::string& path, const std::string& sensor);

// The sensor's rate in the file, Hz; empty if it has none, or no number.
std::optional<double> StatedRate(const std::string& path, const std::string& sensor);

}  // namespace pangea

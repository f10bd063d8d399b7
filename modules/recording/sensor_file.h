#pragma once

// A sensor.yaml as text: EuRoC's, which is of one sensor, or Kalibr's with several below their
// names.

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

namespace pangea {

// The fields of "cam0" or "imu0". Throws std::runtime_error naming `path`: not YAML, a field twice,
// or other sensors only.
YAML::Node LoadSensorFile(std::string text, const std::string& path, const std::string& sensor);

// A warning for each field of the file that nothing reads, with what was probably meant. Those that
// EuRoC and Kalibr write for people pass.
std::vector<std::string> UnreadFields(const std::string& path, const std::string& sensor);

}  // namespace pangea

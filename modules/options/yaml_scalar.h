#pragma once

// One value of a YAML file, read strictly and printed so that it reads back the same. For
// yaml_options only.

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <string>
#include <type_traits>

namespace pangea {

// "file:line", as far as known.
std::string Where(const std::string& file, const YAML::Node& node);

// std::runtime_error: the key at `path` must be what is expected.
[[noreturn]] void ThrowType(const YAML::Node& node, const std::string& file,
                            const std::string& path, const std::string& expected);

std::string ScalarText(bool value);
std::string ScalarText(int32_t value);
std::string ScalarText(int64_t value);
std::string ScalarText(uint64_t value);
std::string ScalarText(double value);
std::string ScalarText(const std::string& value);

// `type` tells people what is expected.
template <typename T>
T ScalarValue(const YAML::Node& node, const std::string& file, const std::string& path,
              const std::string& type) {
  T value{};
  // yaml-cpp tags quoted scalars "!": a quoted number is a string.
  const bool quoted_number = !std::is_same_v<T, std::string> && node.Tag() == "!";
  if (!node.IsScalar() || quoted_number || !YAML::convert<T>::decode(node, value)) {
    ThrowType(node, file, path, type);
  }
  return value;
}

// Finite, and from `low` to `high`.
template <typename T>
T ValueBetween(const YAML::Node& node, const std::string& file, const std::string& path,
               const std::string& type, T low, T high) {
  const T value = ScalarValue<T>(node, file, path, type);
  if (!(value >= low && value <= high) || !std::isfinite(static_cast<double>(value))) {
    ThrowType(node, file, path, type);
  }
  return value;
}

}  // namespace pangea

#pragma once

// Reads one value of a YAML file strictly, and prints it so that it reads back the same. Private to
// yaml_options.

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <string>
#include <type_traits>

namespace pangea {

// "file:line", as far as they are known.
std::string Where(const std::string& file, const YAML::Node& node);

// Throws a std::runtime_error which says that the key at `path` must be `expected`.
[[noreturn]] void ThrowType(const YAML::Node& node, const std::string& file,
                            const std::string& path, const std::string& expected);

std::string ScalarText(bool value);
std::string ScalarText(int32_t value);
std::string ScalarText(int64_t value);
std::string ScalarText(uint64_t value);
std::string ScalarText(double value);
std::string ScalarText(const std::string& value);

// Throws as ThrowType unless the node is a T. `type`: the expected kind of value, for the message.
template <typename T>
T ScalarValue(const YAML::Node& node, const std::string& file, const std::string& path,
              const std::string& type) {
  T value{};
  // yaml-cpp gives quoted scalars the tag "!": a quoted number is a string.
  const bool quoted_number = !std::is_same_v<T, std::string> && node.Tag() == "!";
  if (!node.IsScalar() || quoted_number || !YAML::convert<T>::decode(node, value)) {
    ThrowType(node, file, path, type);
  }
  return value;
}

// The same, and the value must be finite and from `low` to `high`.
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

#include "options/yaml_scalar.h"

#include <fmt/format.h>

#include <stdexcept>

namespace pangea {

std::string Where(const std::string& file, const YAML::Node& node) {
  return node.Mark().is_null() ? file : fmt::format("{}:{}", file, node.Mark().line + 1);
}

void ThrowType(const YAML::Node& node, const std::string& file, const std::string& path,
               const std::string& expected) {
  const std::string found = node.IsScalar()     ? fmt::format("'{}'", node.Scalar())
                            : node.IsSequence() ? "a list"
                            : node.IsMap()      ? "a section of keys"
                                                : "nothing";
  throw std::runtime_error(
      fmt::format("{}: key '{}' must be {}, not {}", Where(file, node), path, expected, found));
}

std::string ScalarText(bool value) { return fmt::format("{}", value); }
std::string ScalarText(int32_t value) { return fmt::format("{}", value); }
std::string ScalarText(int64_t value) { return fmt::format("{}", value); }
std::string ScalarText(uint64_t value) { return fmt::format("{}", value); }

// The shortest text that reads back the same. It always looks like a floating-point number.
std::string ScalarText(double value) {
  std::string text = fmt::format("{}", value);
  if (text == "inf") {
    return ".inf";
  }
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string ScalarText(const std::string& value) {
  YAML::Emitter emitter;
  emitter << YAML::DoubleQuoted << value;
  return emitter.c_str();
}

}  // namespace pangea

#pragma once

// One bound key. For yaml_options only.

#include <functional>
#include <memory>
#include <string>

#include "options/yaml_options.h"

namespace pangea {

struct YamlOptions::Entry {
  std::string key;
  bool required = false;
  // (node, file, path of the key for messages)
  std::function<void(const YAML::Node&, const std::string&, const std::string&)> read;
  // What stands behind "key:", newline included; " # help" comes before the first newline.
  std::function<std::string(const Style&)> print;
  std::string help;  // with bounds and unit; empty for none
  std::unique_ptr<YamlOptions> section;
};

}  // namespace pangea

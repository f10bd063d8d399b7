#pragma once

// One bound key of YamlOptions. Private to yaml_options.

#include <functional>
#include <memory>
#include <string>

#include "options/yaml_options.h"

namespace pangea {

struct YamlOptions::Entry {
  std::string key;
  bool required = false;
  // Called with (node, file name, path of the key); the latter two are for messages.
  std::function<void(const YAML::Node&, const std::string&, const std::string&)> read;
  // Returns the text after "key:", with its newline; " # help" comes before the first newline.
  std::function<std::string(const Style&)> print;
  std::string help;  // includes bounds and unit; empty: no help
  std::unique_ptr<YamlOptions> section;
};

}  // namespace pangea

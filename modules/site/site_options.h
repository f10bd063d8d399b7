#pragma once

#include <filesystem>
#include <string>

#include "options/yaml_options.h"
#include "site/site.h"

namespace pangea::site {

// A process' options in the site: those of options/<process>.yaml, or the defaults. Throws
// std::runtime_error with file, field and correction.
template <typename Options>
Options ReadOptions(const Site& site, const std::string& process) {
  Options options;
  YamlOptions yaml;
  options.Visit(yaml);
  if (const std::filesystem::path file = site.options() / (process + ".yaml");
      std::filesystem::exists(file)) {
    yaml.ReadFile(file);
  }
  return options;
}

}  // namespace pangea::site

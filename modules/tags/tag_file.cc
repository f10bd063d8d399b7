#include "tags/tag_file.h"

#include <fmt/format.h>

#include <stdexcept>

#include "options/yaml_options.h"

namespace pangea {

std::vector<SizedTags> ReadTagFile(const std::filesystem::path& file) {
  std::vector<SizedTags> tags;
  YamlOptions yaml;
  yaml.AddList("tags", &tags, [](YamlOptions& item, SizedTags& of) { of.Visit(item); });
  yaml.Require("tags");
  yaml.ReadFile(file.string());
  try {
    TagSizes{tags};
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), error.what()));
  }
  return tags;
}

}  // namespace pangea

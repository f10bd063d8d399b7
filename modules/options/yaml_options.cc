#include "options/yaml_options.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <set>
#include <stdexcept>

#include "files/text_file.h"
#include "options/nearest_word.h"
#include "options/yaml_options_entry.h"
#include "options/yaml_scalar.h"

namespace pangea {
namespace {

// Suggests a known path. The most likely mistake is the right name in the wrong section, the next
// one a misspelt name.
std::string PathHint(const std::string& path, const std::string& key, const std::string& above,
                     const std::vector<std::string>& keys,
                     const std::map<std::string, std::string>& values) {
  const std::string name = fmt::format(".{}", path.substr(path.rfind('.') + 1));
  for (const auto& [known, value] : values) {
    if (known.starts_with(above) && known.ends_with(name)) {
      return fmt::format("; did you mean '{}'?", known);
    }
  }
  return NearestWordHint(key.substr(0, key.find('.')), keys, above);
}

YAML::Node Load(const std::string& text, const std::string& name) {
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(
        fmt::format("{}:{}: not YAML: {}", name, error.mark.line + 1, error.msg));
  }
}

}  // namespace

YamlOptions::YamlOptions() = default;
YamlOptions::~YamlOptions() = default;
YamlOptions::YamlOptions(YamlOptions&&) noexcept = default;
YamlOptions& YamlOptions::operator=(YamlOptions&&) noexcept = default;

YamlOptions::Entry* YamlOptions::Find(const std::string& key) const {
  const auto entry = std::find_if(entries_.begin(), entries_.end(),
                                  [&key](const auto& known) { return known->key == key; });
  return entry == entries_.end() ? nullptr : entry->get();
}

std::vector<std::string> YamlOptions::Keys() const {
  std::vector<std::string> keys;
  for (const auto& entry : entries_) {
    keys.push_back(entry->key);
  }
  return keys;
}

std::map<std::string, std::string> YamlOptions::Values() const {
  std::map<std::string, std::string> values;
  for (const auto& entry : entries_) {
    if (!entry->section) {
      const std::string text = entry->print({.help = false});  // " 16\n"
      values[entry->key] = text.substr(1, text.size() - 2);
      continue;
    }
    for (const auto& [path, value] : entry->section->Values()) {
      values[fmt::format("{}.{}", entry->key, path)] = value;
    }
  }
  return values;
}

YamlOptions* YamlOptions::FindSection(const std::string& key) {
  Entry* const entry = Find(key);
  return entry == nullptr ? nullptr : entry->section.get();
}

void YamlOptions::Require(const std::string& key) {
  Entry* const entry = Find(key);
  if (entry == nullptr) {
    throw std::logic_error(fmt::format("option '{}' is required but not bound", key));
  }
  entry->required = true;
}

void YamlOptions::Read(const YAML::Node& node, const std::string& file, const std::string& path) {
  if (!node.IsMap() && !node.IsNull()) {
    ThrowType(node, file, path.empty() ? "(top)" : path.substr(0, path.size() - 1),
              "a section of keys");
  }
  std::set<std::string> seen;
  for (const auto& item : node) {
    if (!item.first.IsScalar()) {
      throw std::runtime_error(
          fmt::format("{}: a key must be a plain word", Where(file, item.first)));
    }
    const std::string& key = item.first.Scalar();
    if (!seen.insert(key).second) {
      throw std::runtime_error(
          fmt::format("{}: key '{}{}' stands twice", Where(file, item.first), path, key));
    }
    const Entry* const entry = Find(key);
    if (entry == nullptr) {
      throw std::runtime_error(fmt::format("{}: unknown key '{}{}'{}", Where(file, item.first),
                                           path, key, NearestWordHint(key, Keys(), path)));
    }
    entry->read(item.second, file, path + key);
  }
  for (const auto& entry : entries_) {
    if (entry->required && !seen.contains(entry->key)) {
      throw std::runtime_error(
          fmt::format("{}: key '{}{}' is missing", Where(file, node), path, entry->key));
    }
  }
}

void YamlOptions::ReadText(const std::string& text, const std::string& name) {
  Read(Load(text, name), name, "");
}

std::vector<std::string> YamlOptions::ReadKnown(const std::string& text, const std::string& name) {
  const YAML::Node node = Load(text, name);
  std::vector<std::string> unknown;
  TakeUnknown(node, "", &unknown);
  Read(node, name, "");
  return unknown;
}

// Removes the unknown keys from the node and its sections, and appends them to `unknown`.
void YamlOptions::TakeUnknown(YAML::Node node, const std::string& path,
                              std::vector<std::string>* unknown) const {
  if (!node.IsMap()) {
    return;
  }
  std::vector<std::string> keys;
  for (const auto& item : node) {
    if (item.first.IsScalar()) {
      keys.push_back(item.first.Scalar());
    }
  }
  for (const std::string& key : keys) {
    const YAML::Node value = node[key];
    if (const Entry* const entry = Find(key); entry == nullptr) {
      unknown->push_back(path + key + (value.IsScalar() ? " " + value.Scalar() : ""));
      node.remove(key);
    } else if (entry->section) {
      entry->section->TakeUnknown(value, path + key + ".", unknown);
    }
  }
}

void YamlOptions::ReadFile(const std::string& path) { ReadText(ReadTextFile(path), path); }

void YamlOptions::Set(const std::string& path, const std::string& text) {
  YamlOptions* section = this;
  std::string above;  // "window."
  std::string key = path;
  for (size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.')) {
    YamlOptions* const next = section->FindSection(key.substr(0, dot));
    if (next == nullptr) {
      break;
    }
    section = next;
    above += key.substr(0, dot + 1);
    key.erase(0, dot + 1);
  }
  const Entry* const entry = section->Find(key);
  if (entry == nullptr || entry->section) {
    throw std::runtime_error(fmt::format("no option '{}'{}", path,
                                         PathHint(path, key, above, section->Keys(), Values())));
  }
  entry->read(YAML::Node(text), "--set", path);
}

std::string YamlOptions::PrintStyled(const Style& style) const {
  std::string text;
  for (const auto& entry : entries_) {
    std::string value = entry->print(style);
    if (style.help && !entry->help.empty()) {
      value.insert(value.find('\n'), fmt::format("  # {}", entry->help));
    }
    text += fmt::format("{:{}}{}:{}", "", style.indent, entry->key, value);
  }
  return text;
}

std::string YamlOptions::Print() const { return PrintStyled({}); }

std::string YamlOptions::PrintWithoutHelp() const { return PrintStyled({.help = false}); }

}  // namespace pangea

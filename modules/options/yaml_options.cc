#include "options/yaml_options.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "files/text_file.h"
#include "options/nearest_word.h"

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

namespace {

std::string Where(const std::string& file, const YAML::Node& node) {
  return node.Mark().is_null() ? file : fmt::format("{}:{}", file, node.Mark().line + 1);
}

[[noreturn]] void ThrowType(const YAML::Node& node, const std::string& file,
                            const std::string& path, const std::string& expected) {
  const std::string found = node.IsScalar()     ? fmt::format("'{}'", node.Scalar())
                            : node.IsSequence() ? "a list"
                            : node.IsMap()      ? "a section of keys"
                                                : "nothing";
  throw std::runtime_error(
      fmt::format("{}: key '{}' must be {}, not {}", Where(file, node), path, expected, found));
}

template <typename T>
std::string ScalarText(const T& value) {
  return fmt::format("{}", value);
}
// Shortest text that reads back the same, and always a float to the eye.
template <typename T>
std::string FloatText(T value) {
  std::string text = fmt::format("{}", value);
  if (text == "inf") {
    return ".inf";
  }
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}
std::string ScalarText(const double& value) { return FloatText(value); }
std::string ScalarText(const float& value) { return FloatText(value); }
std::string ScalarText(const std::string& value) {
  YAML::Emitter emitter;
  emitter << YAML::DoubleQuoted << value;
  return emitter.c_str();
}

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

template <typename T>
T ValueWithin(const YAML::Node& node, const std::string& file, const std::string& path,
              const std::string& type, const std::function<bool(double)>& is_within) {
  const T value = ScalarValue<T>(node, file, path, type);
  if (!std::isfinite(static_cast<double>(value)) || !is_within(static_cast<double>(value))) {
    ThrowType(node, file, path, type);
  }
  return value;
}

std::string RangeText(const std::string& of, double low, double high) {
  return fmt::format("{} from {} to {}", of, low, high);
}

// "0.001 to 100 m: of the worst direction".
std::string HelpText(const OptionBounds& bounds, const std::string& unit, const std::string& help) {
  return fmt::format("{} to {}{}{}{}{}", bounds.low, bounds.high, unit.empty() ? "" : " ", unit,
                     help.empty() ? "" : ": ", help);
}

std::function<bool(double)> Between(double low, double high) {
  return [low, high](double value) { return value >= low && value <= high; };
}

// The right name in the wrong section is the likeliest slip; else a slip in the name itself.
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

}  // namespace

YamlOptions::YamlOptions() = default;
YamlOptions::~YamlOptions() = default;
YamlOptions::YamlOptions(YamlOptions&&) noexcept = default;
YamlOptions& YamlOptions::operator=(YamlOptions&&) noexcept = default;

YamlOptions::Entry* YamlOptions::Find(const std::string& key) const {
  const auto entry = std::ranges::find(entries_, key, &Entry::key);
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

YamlOptions::Entry& YamlOptions::NewEntry(const std::string& key) {
  if (Find(key) != nullptr) {
    throw std::logic_error(fmt::format("option '{}' is bound twice", key));
  }
  entries_.push_back(std::make_unique<Entry>());
  entries_.back()->key = key;
  return *entries_.back();
}

template <typename T>
void YamlOptions::AddScalar(const std::string& key, const std::string& type, T* value) {
  Entry& entry = NewEntry(key);
  entry.read = [value, type](const YAML::Node& node, const std::string& file,
                             const std::string& path) {
    *value = ScalarValue<T>(node, file, path, type);
  };
  entry.print = [value](const Style&) { return fmt::format(" {}\n", ScalarText(*value)); };
}

void YamlOptions::AddWithin(const std::string& key, const std::string& type,
                            const std::function<bool(double)>& is_within, double* value) {
  Entry& entry = NewEntry(key);
  entry.read = [value, type, is_within](const YAML::Node& node, const std::string& file,
                                        const std::string& path) {
    *value = ValueWithin<double>(node, file, path, type, is_within);
  };
  entry.print = [value](const Style&) { return fmt::format(" {}\n", ScalarText(*value)); };
}

void YamlOptions::AddBetween(const std::string& key, double low, double high, double* value) {
  AddWithin(key, RangeText("a number", low, high), Between(low, high), value);
}

template <typename T>
void YamlOptions::AddWhole(const std::string& key, T low, T high, T* value) {
  Entry& entry = NewEntry(key);
  const auto least = static_cast<double>(low), most = static_cast<double>(high);
  entry.read = [=](const YAML::Node& node, const std::string& file, const std::string& path) {
    *value = ValueWithin<T>(node, file, path, RangeText("a whole number", least, most),
                            Between(least, most));
  };
  entry.print = [value](const Style&) { return fmt::format(" {}\n", ScalarText(*value)); };
}

void YamlOptions::AddBetween(const std::string& key, int32_t low, int32_t high, int32_t* value) {
  AddWhole(key, low, high, value);
}

void YamlOptions::AddBetween(const std::string& key, double low, double high,
                             std::optional<double>* value) {
  Add(key, value);
  entries_.back()->read = [=](const YAML::Node& node, const std::string& file,
                              const std::string& path) {
    value->reset();
    if (!node.IsNull()) {
      *value = ValueWithin<double>(node, file, path, RangeText("a number", low, high),
                                   Between(low, high));
    }
  };
}

void YamlOptions::Add(const std::string& key, std::optional<double>* value) {
  Entry& entry = NewEntry(key);
  entry.read = [value](const YAML::Node& node, const std::string& file, const std::string& path) {
    value->reset();
    if (!node.IsNull()) {
      *value = ScalarValue<double>(node, file, path, "a number");
    }
  };
  entry.print = [value](const Style&) {
    return fmt::format(" {}\n", value->has_value() ? ScalarText(**value) : "~");
  };
}

template <typename T>
void YamlOptions::AddScalars(const std::string& key, const std::string& type,
                             std::vector<T>* value) {
  Entry& entry = NewEntry(key);
  entry.read = [value, type](const YAML::Node& node, const std::string& file,
                             const std::string& path) {
    if (!node.IsSequence()) {
      ThrowType(node, file, path, "a list, each item " + type);
    }
    std::vector<T> items;
    for (size_t i = 0; i < node.size(); ++i) {
      items.push_back(ScalarValue<T>(node[i], file, fmt::format("{}[{}]", path, i), type));
    }
    *value = std::move(items);
  };
  entry.print = [value](const Style&) {
    std::string text;
    for (const T& item : *value) {
      text += fmt::format("{}{}", text.empty() ? "" : ", ", ScalarText(item));
    }
    return fmt::format(" [{}]\n", text);
  };
}

void YamlOptions::Add(const std::string& key, bool* value, const std::string& help) {
  AddScalar(key, "true or false", value);
  entries_.back()->help = help;
}

void YamlOptions::Add(const std::string& key, int32_t* value, const OptionBounds& bounds,
                      const std::string& unit, const std::string& help) {
  AddBetween(key, static_cast<int32_t>(bounds.low), static_cast<int32_t>(bounds.high), value);
  entries_.back()->help = HelpText(bounds, unit, help);
}

void YamlOptions::Add(const std::string& key, int64_t* value, const OptionBounds& bounds,
                      const std::string& unit, const std::string& help) {
  AddWhole(key, static_cast<int64_t>(bounds.low), static_cast<int64_t>(bounds.high), value);
  entries_.back()->help = HelpText(bounds, unit, help);
}

void YamlOptions::Add(const std::string& key, double* value, const OptionBounds& bounds,
                      const std::string& unit, const std::string& help) {
  AddBetween(key, bounds.low, bounds.high, value);
  entries_.back()->help = HelpText(bounds, unit, help);
}

void YamlOptions::Add(const std::string& key, int32_t* value) {
  AddScalar(key, "a whole number", value);
}
void YamlOptions::Add(const std::string& key, int64_t* value) {
  AddScalar(key, "a whole number", value);
}
void YamlOptions::Add(const std::string& key, uint64_t* value) {
  AddScalar(key, "a whole number >= 0", value);
}
void YamlOptions::Add(const std::string& key, float* value) { AddScalar(key, "a number", value); }
void YamlOptions::Add(const std::string& key, double* value) { AddScalar(key, "a number", value); }
void YamlOptions::AddPositive(const std::string& key, double* value) {
  AddWithin(
      key, "a number above 0", [](double x) { return x > 0; }, value);
}
void YamlOptions::AddNotNegative(const std::string& key, double* value) {
  AddWithin(
      key, "a number, 0 or above", [](double x) { return x >= 0; }, value);
}
void YamlOptions::Add(const std::string& key, std::string* value) {
  AddScalar(key, "a text", value);
}
void YamlOptions::Add(const std::string& key, std::vector<double>* value) {
  AddScalars(key, "a number", value);
}
void YamlOptions::Add(const std::string& key, std::vector<std::string>* value) {
  AddScalars(key, "a text", value);
}

void YamlOptions::AddPairBetween(const std::string& key, double low, double high, double* first,
                                 double* second) {
  Entry& entry = NewEntry(key);
  entry.read = [=](const YAML::Node& node, const std::string& file, const std::string& path) {
    if (!node.IsSequence() || node.size() != 2) {
      ThrowType(node, file, path,
                fmt::format("a list of two numbers, each from {} to {}", low, high));
    }
    const auto item = [&](size_t i) {
      return ValueWithin<double>(node[i], file, fmt::format("{}[{}]", path, i),
                                 RangeText("a number", low, high), Between(low, high));
    };
    *first = item(0);
    *second = item(1);
  };
  entry.print = [first, second](const Style&) {
    return fmt::format(" [{}, {}]\n", ScalarText(*first), ScalarText(*second));
  };
}

void YamlOptions::AddText(const std::string& key, size_t max_bytes, std::string* value) {
  Entry& entry = NewEntry(key);
  entry.read = [=](const YAML::Node& node, const std::string& file, const std::string& path) {
    auto text = ScalarValue<std::string>(node, file, path, "a text");
    if (text.size() > max_bytes) {
      throw std::runtime_error(
          fmt::format("{}: key '{}' must be a text of at most {} bytes, not {}", Where(file, node),
                      path, max_bytes, text.size()));
    }
    *value = std::move(text);
  };
  entry.print = [value](const Style&) { return fmt::format(" {}\n", ScalarText(*value)); };
}

void YamlOptions::AddNamed(const std::string& key, const std::vector<std::string>& names,
                           const std::function<void(size_t)>& set,
                           const std::function<size_t()>& get, const std::string& help) {
  Entry& entry = NewEntry(key);
  entry.help = help.empty() ? "" : fmt::format("{}: {}", fmt::join(names, ", "), help);
  entry.read = [names, set](const YAML::Node& node, const std::string& file,
                            const std::string& path) {
    const auto found = node.IsScalar() ? std::ranges::find(names, node.Scalar()) : names.end();
    if (found == names.end()) {
      ThrowType(node, file, path, fmt::format("one of {}", fmt::join(names, ", ")));
    }
    set(static_cast<size_t>(found - names.begin()));
  };
  entry.print = [names, get](const Style&) { return fmt::format(" {}\n", names[get()]); };
}

YamlOptions& YamlOptions::Section(const std::string& key, const std::string& help) {
  Entry& entry = NewEntry(key);
  entry.help = help;
  entry.section = std::make_unique<YamlOptions>();
  YamlOptions* section = entry.section.get();
  entry.read = [section](const YAML::Node& node, const std::string& file, const std::string& path) {
    section->Read(node, file, path + ".");
  };
  entry.print = [section](const Style& style) {
    return fmt::format("\n{}", section->PrintStyled({style.indent + 2, style.help}));
  };
  return *section;
}

void YamlOptions::AddSequence(const std::string& key,
                              std::function<std::vector<YamlOptions>(size_t)> resize,
                              std::function<std::vector<YamlOptions>()> current) {
  Entry& entry = NewEntry(key);
  entry.read = [resize = std::move(resize)](const YAML::Node& node, const std::string& file,
                                            const std::string& path) {
    if (!node.IsSequence()) {
      ThrowType(node, file, path, "a list");
    }
    std::vector<YamlOptions> items = resize(node.size());
    for (size_t i = 0; i < items.size(); ++i) {
      items[i].Read(node[i], file, fmt::format("{}[{}].", path, i));
    }
  };
  entry.print = [current = std::move(current)](const Style& style) {
    const std::vector<YamlOptions> items = current();
    std::string text = items.empty() ? " []\n" : "\n";
    for (const YamlOptions& item : items) {
      std::string block = item.PrintStyled({style.indent + 4, style.help});
      block[static_cast<size_t>(style.indent) + 2] = '-';
      text += block;
    }
    return text;
  };
}

void YamlOptions::AddOptionalSection(const std::string& key, std::function<YamlOptions()> start,
                                     std::function<std::optional<YamlOptions>()> current) {
  Entry& entry = NewEntry(key);
  entry.read = [start = std::move(start)](const YAML::Node& node, const std::string& file,
                                          const std::string& path) {
    if (!node.IsNull()) {
      start().Read(node, file, path + ".");
    }
  };
  entry.print = [current = std::move(current)](const Style& style) {
    const std::optional<YamlOptions> section = current();
    return section ? fmt::format("\n{}", section->PrintStyled({style.indent + 2, style.help}))
                   : std::string(" ~\n");
  };
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
  YAML::Node node;
  try {
    node = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw std::runtime_error(
        fmt::format("{}:{}: not YAML: {}", name, error.mark.line + 1, error.msg));
  }
  Read(node, name, "");
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

// The part of YamlOptions that binds values: how each kind of value is read and printed.

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "options/yaml_options.h"
#include "options/yaml_options_entry.h"
#include "options/yaml_scalar.h"

namespace pangea {
namespace {

std::string RangeText(const std::string& of, double low, double high) {
  return fmt::format("{} from {} to {}", of, low, high);
}

// For example "0.001 to 100 m: of the worst direction".
std::string HelpText(const OptionBounds& bounds, const std::string& unit, const std::string& help) {
  return fmt::format("{} to {}{}{}{}{}", bounds.low, bounds.high, unit.empty() ? "" : " ", unit,
                     help.empty() ? "" : ": ", help);
}

}  // namespace

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

template <typename T>
void YamlOptions::AddNumber(const std::string& key, const std::string& of, T low, T high,
                            T* value) {
  Entry& entry = NewEntry(key);
  const std::string type = RangeText(of, static_cast<double>(low), static_cast<double>(high));
  entry.read = [=](const YAML::Node& node, const std::string& file, const std::string& path) {
    *value = ValueBetween<T>(node, file, path, type, low, high);
  };
  entry.print = [value](const Style&) { return fmt::format(" {}\n", ScalarText(*value)); };
}

void YamlOptions::AddBetween(const std::string& key, double low, double high, double* value) {
  AddNumber(key, "a number", low, high, value);
}

void YamlOptions::AddBetween(const std::string& key, int32_t low, int32_t high, int32_t* value) {
  AddNumber(key, "a whole number", low, high, value);
}

void YamlOptions::AddBetween(const std::string& key, double low, double high,
                             std::optional<double>* value) {
  Entry& entry = NewEntry(key);
  entry.read = [=](const YAML::Node& node, const std::string& file, const std::string& path) {
    value->reset();
    if (!node.IsNull()) {
      *value = ValueBetween<double>(node, file, path, RangeText("a number", low, high), low, high);
    }
  };
  entry.print = [value](const Style&) {
    return fmt::format(" {}\n", value->has_value() ? ScalarText(**value) : "~");
  };
}

void YamlOptions::Add(const std::string& key, int32_t* value, const OptionBounds& bounds,
                      const std::string& unit, const std::string& help) {
  AddBetween(key, static_cast<int32_t>(bounds.low), static_cast<int32_t>(bounds.high), value);
  entries_.back()->help = HelpText(bounds, unit, help);
}

void YamlOptions::Add(const std::string& key, int64_t* value, const OptionBounds& bounds,
                      const std::string& unit, const std::string& help) {
  AddNumber(key, "a whole number", static_cast<int64_t>(bounds.low),
            static_cast<int64_t>(bounds.high), value);
  entries_.back()->help = HelpText(bounds, unit, help);
}

void YamlOptions::Add(const std::string& key, double* value, const OptionBounds& bounds,
                      const std::string& unit, const std::string& help) {
  AddBetween(key, bounds.low, bounds.high, value);
  entries_.back()->help = HelpText(bounds, unit, help);
}

void YamlOptions::Add(const std::string& key, bool* value, const std::string& help) {
  AddScalar(key, "true or false", value);
  entries_.back()->help = help;
}

void YamlOptions::Add(const std::string& key, uint64_t* value) {
  AddScalar(key, "a whole number >= 0", value);
}

void YamlOptions::Add(const std::string& key, std::string* value) {
  AddScalar(key, "a text", value);
}

void YamlOptions::AddPairBetween(const std::string& key, double low, double high, double* first,
                                 double* second) {
  Entry& entry = NewEntry(key);
  entry.read = [=](const YAML::Node& node, const std::string& file, const std::string& path) {
    if (!node.IsSequence() || node.size() != 2) {
      ThrowType(node, file, path, RangeText("a list of two numbers, each", low, high));
    }
    const std::string type = RangeText("a number", low, high);
    *first = ValueBetween<double>(node[0], file, path + "[0]", type, low, high);
    *second = ValueBetween<double>(node[1], file, path + "[1]", type, low, high);
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
    const auto found =
        node.IsScalar() ? std::find(names.begin(), names.end(), node.Scalar()) : names.end();
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

}  // namespace pangea

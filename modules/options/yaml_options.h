#pragma once

// Reads options from YAML files: keys are bound to the members of plain structs. Reading is strict:
// an unknown or repeated key, a wrong type, a value out of bounds and a missing required key are
// errors. The message names file, line and key, and for an unknown key the nearest known one.
//
// An options struct describes its members in its Visit: key, bounds, unit, a line of help. Visit is
// a template, so that the struct need not include this file:
//
//   struct FusionOptions {
//     int min_inliers = 16;
//     WindowOptions window;
//
//     template <typename Archive>
//     void Visit(Archive& archive) {
//       archive.Add("min_inliers", &min_inliers, {4, 100000}, "", "distinct landmarks");
//       archive.Section("window", &window, "the local windows that are aligned");
//     }
//   };
//   FusionOptions options;
//   YamlOptions yaml;
//   options.Visit(yaml);
//   yaml.ReadFile(path);              // throws std::runtime_error; other keys keep their values
//   yaml.Set("window.num_keyframes", "7");
//   std::string text = yaml.Print();  // the options in force, readable by ReadFile
//
// The bound struct must outlive the YamlOptions.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace YAML {
class Node;
}

namespace pangea {

// The allowed range of a value; both ends are allowed.
struct OptionBounds {
  double low = 0;
  double high = 0;
};

class YamlOptions {
 public:
  YamlOptions();
  ~YamlOptions();
  YamlOptions(YamlOptions&&) noexcept;
  YamlOptions& operator=(YamlOptions&&) noexcept;

  // Bind a key to a value. `unit` (empty for a count or a share) and `help` are printed for people.
  void Add(const std::string& key, int32_t* value, const OptionBounds& bounds,
           const std::string& unit, const std::string& help);
  void Add(const std::string& key, int64_t* value, const OptionBounds& bounds,
           const std::string& unit, const std::string& help);
  void Add(const std::string& key, double* value, const OptionBounds& bounds,
           const std::string& unit, const std::string& help);

  void Add(const std::string& key, bool* value, const std::string& help = "");
  void Add(const std::string& key, uint64_t* value);
  void Add(const std::string& key, std::string* value);

  // Values from `low` to `high`, both ends allowed.
  void AddBetween(const std::string& key, double low, double high, double* value);
  void AddBetween(const std::string& key, int32_t low, int32_t high, int32_t* value);
  void AddBetween(const std::string& key, double low, double high,
                  std::optional<double>* value);  // "~" in the file: no value
  // A list of two numbers, both from `low` to `high`.
  void AddPairBetween(const std::string& key, double low, double high, double* first,
                      double* second);
  // A text of at most `max_bytes` bytes.
  void AddText(const std::string& key, size_t max_bytes, std::string* value);

  // An enum; the file has the names of its values.
  template <typename Enum>
  void AddChoice(const std::string& key, Enum* value,
                 std::vector<std::pair<std::string, Enum>> choices, const std::string& help = "") {
    std::vector<std::string> names;
    names.reserve(choices.size());
    for (const auto& [name, choice] : choices) {
      names.push_back(name);
    }
    AddNamed(
        key, names, [value, choices](size_t index) { *value = choices[index].second; },
        [value, choices] {
          size_t index = 0;
          while (index + 1 < choices.size() && choices[index].second != *value) {
            ++index;
          }
          return index;
        },
        help);
  }

  // A nested struct: bind its members to the returned section, which is valid as long as *this.
  YamlOptions& Section(const std::string& key, const std::string& help = "");
  // A nested struct that has a Visit.
  template <typename T>
  void Section(const std::string& key, T* value, const std::string& help) {
    value->Visit(Section(key, help));
  }

  // A list of structs; `bind(yaml, item)` binds the members of an item. A list in the file replaces
  // the default list.
  template <typename T, typename BindItem>
  void AddList(const std::string& key, std::vector<T>* items, BindItem bind) {
    AddSequence(
        key,
        [items, bind](size_t count) {
          items->assign(count, T{});
          return BindAll(items, bind);
        },
        [items, bind] { return BindAll(items, bind); });
  }

  // An optional struct: if the file has its section, `bind(yaml, value)` binds the members; else it
  // has no value.
  template <typename T, typename BindValue>
  void AddOptional(const std::string& key, std::optional<T>* value, BindValue bind) {
    AddOptionalSection(
        key,
        [value, bind] {
          YamlOptions section;
          bind(section, value->emplace());
          return section;
        },
        [value, bind] {
          std::optional<YamlOptions> section;
          if (value->has_value()) {
            bind(section.emplace(), **value);
          }
          return section;
        });
  }

  // The key must be in the file.
  void Require(const std::string& key);

  // Both throw std::runtime_error. `name`: the file's name for messages.
  void ReadFile(const std::string& path);
  void ReadText(const std::string& text, const std::string& name);
  // Reads a text that another version may have written: ignores unknown keys, and returns them with
  // their values, for example "window.size 5".
  std::vector<std::string> ReadKnown(const std::string& text, const std::string& name);

  // Sets one value by its path, such as "window.num_keyframes", from a text as in a file. Throws
  // std::runtime_error; for an unknown path the message names the nearest known one.
  void Set(const std::string& path, const std::string& text);
  // The section with this key; null if there is none.
  YamlOptions* FindSection(const std::string& key);

  // All keys with their current values, as YAML, with bounds, unit and help as comments.
  std::string Print() const;
  std::string PrintWithoutHelp() const;
  std::vector<std::string> Keys() const;
  // The text of all values by path, with those of sections.
  std::map<std::string, std::string> Values() const;

 private:
  struct Entry;

  template <typename T, typename BindItem>
  static std::vector<YamlOptions> BindAll(std::vector<T>* items, BindItem bind) {
    std::vector<YamlOptions> bound(items->size());
    for (size_t i = 0; i < items->size(); ++i) {
      bind(bound[i], (*items)[i]);
    }
    return bound;
  }

  void AddNamed(const std::string& key, const std::vector<std::string>& names,
                const std::function<void(size_t)>& set, const std::function<size_t()>& get,
                const std::string& help);
  void AddSequence(const std::string& key, std::function<std::vector<YamlOptions>(size_t)> resize,
                   std::function<std::vector<YamlOptions>()> current);
  void AddOptionalSection(const std::string& key, std::function<YamlOptions()> start,
                          std::function<std::optional<YamlOptions>()> current);
  template <typename T>
  void AddScalar(const std::string& key, const std::string& type, T* value);
  // `of`: the kind of value, such as "a number", for messages.
  template <typename T>
  void AddNumber(const std::string& key, const std::string& of, T low, T high, T* value);
  Entry& NewEntry(const std::string& key);
  void Read(const YAML::Node& node, const std::string& file, const std::string& path);
  void TakeUnknown(YAML::Node node, const std::string& path,
                   std::vector<std::string>* unknown) const;
  Entry* Find(const std::string& key) const;
  struct Style {
    int indent = 0;
    bool help = true;
  };
  std::string PrintStyled(const Style& style) const;

  std::vector<std::unique_ptr<Entry>> entries_;
};

}  // namespace pangea

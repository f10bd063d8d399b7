#pragma once

// Options on disk: YAML keys bound to the members of plain structs, strictly. An unknown or doubled
// key, a wrong type and a missing required key are errors that name file, line and key, and for an
// unknown key the nearest known one.
//
//   void Bind(YamlOptions& yaml, FusionOptions& o) {
//     yaml.Add("min_inliers", &o.min_inliers);
//     Bind(yaml.Section("window"), o.window);
//     yaml.AddChoice("scope", &o.scope, {{"all", Scope::kAll}, {"paper", Scope::kPaper}});
//   }
//   FusionOptions options;
//   YamlOptions yaml;
//   Bind(yaml, options);
//   yaml.ReadFile(path);              // throws std::runtime_error; other keys keep their defaults
//   std::string text = yaml.Print();  // the effective options, readable by ReadFile
//
// The bound struct must outlive the YamlOptions.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace YAML {
class Node;
}

namespace pangea {

class YamlOptions {
 public:
  YamlOptions();
  ~YamlOptions();
  YamlOptions(YamlOptions&&) noexcept;
  YamlOptions& operator=(YamlOptions&&) noexcept;

  void Add(const std::string& key, bool* value);
  void Add(const std::string& key, int32_t* value);
  void Add(const std::string& key, int64_t* value);
  void Add(const std::string& key, uint64_t* value);
  void Add(const std::string& key, float* value);
  void Add(const std::string& key, double* value);
  void Add(const std::string& key, std::string* value);
  void Add(const std::string& key, std::optional<double>* value);  // "~": none
  void AddPositive(const std::string& key, double* value);         // and finite
  void AddNotNegative(const std::string& key, double* value);      // and finite
  // From `low` to `high`, both taken.
  void AddBetween(const std::string& key, double low, double high, double* value);
  void AddBetween(const std::string& key, int32_t low, int32_t high, int32_t* value);
  void AddBetween(const std::string& key, double low, double high,
                  std::optional<double>* value);  // "~": none
  // Where `is_within` says so, and finite; `type` tells people what that is: "a number above 0".
  void AddWithin(const std::string& key, const std::string& type,
                 const std::function<bool(double)>& is_within, double* value);
  void Add(const std::string& key, std::vector<double>* value);
  void Add(const std::string& key, std::vector<std::string>* value);

  // An enum by names.
  template <typename Enum>
  void AddChoice(const std::string& key, Enum* value,
                 std::vector<std::pair<std::string, Enum>> choices) {
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
        });
  }

  // A nested struct: bind its members to what this returns (valid as long as *this).
  YamlOptions& Section(const std::string& key);

  // A list of structs, each bound by `bind(yaml, item)`; the file's list replaces the default.
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

  // A struct that need not be there: a section bound by `bind(yaml, value)`, or no value.
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

  // This key must be in the file.
  void Require(const std::string& key);

  void ReadFile(const std::string& path);
  // `name` stands for the file in messages.
  void ReadText(const std::string& text, const std::string& name);

  // All keys with their values now, as YAML.
  std::string Print() const;

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
                const std::function<void(size_t)>& set, const std::function<size_t()>& get);
  void AddSequence(const std::string& key, std::function<std::vector<YamlOptions>(size_t)> resize,
                   std::function<std::vector<YamlOptions>()> current);
  void AddOptionalSection(const std::string& key, std::function<YamlOptions()> start,
                          std::function<std::optional<YamlOptions>()> current);
  template <typename T>
  void AddScalar(const std::string& key, const std::string& type, T* value);
  template <typename T>
  void AddScalars(const std::string& key, const std::string& type, std::vector<T>* value);
  Entry& NewEntry(const std::string& key);
  void Read(const YAML::Node& node, const std::string& file, const std::string& path);
  std::string PrintIndented(int indent) const;

  std::vector<std::unique_ptr<Entry>> entries_;
};

}  // namespace pangea

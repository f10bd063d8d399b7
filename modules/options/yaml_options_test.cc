#include "options/yaml_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <stdexcept>

namespace pangea {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

enum class Scope { kAll, kPaper };

struct Item {
  int id = 0;
  std::string name = "none";
};

struct Options {
  bool flag = true;
  int count = 3;
  uint64_t seed = 7;
  double gate_m = 0.1;
  std::string file = "a: \"b\"";
  Scope scope = Scope::kAll;
  struct Window {
    int keyframes = 10;
  } window;
  std::vector<Item> items;
  std::optional<Item> extra;
  std::optional<double> bound;
};

void Bind(YamlOptions& yaml, Options& o) {
  yaml.Add("flag", &o.flag);
  yaml.AddBetween("count", -10, 10, &o.count);
  yaml.Add("seed", &o.seed);
  yaml.AddBetween("gate_m", 0, 10, &o.gate_m);
  yaml.Add("file", &o.file);
  yaml.AddChoice<Scope>("scope", &o.scope, {{"all", Scope::kAll}, {"paper", Scope::kPaper}});
  yaml.Section("window").AddBetween("keyframes", 1, 100, &o.window.keyframes);
  yaml.AddList("items", &o.items, [](YamlOptions& y, Item& item) {
    y.AddBetween("id", 0, 9, &item.id);
    y.Add("name", &item.name);
    y.Require("id");
  });
  yaml.AddOptional("extra", &o.extra, [](YamlOptions& y, Item& item) {
    y.AddBetween("id", 0, 9, &item.id);
    y.Add("name", &item.name);
  });
  yaml.AddBetween("bound", 0, 1, &o.bound);
}

Options Read(const std::string& text) {
  Options options;
  YamlOptions yaml;
  Bind(yaml, options);
  yaml.ReadText(text, "test.yaml");
  return options;
}

std::string Complaint(const std::string& text) {
  try {
    Read(text);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}

TEST(YamlOptions, ReadsEveryTypeAndKeepsDefaults) {
  const Options o = Read(
      "flag: false\ncount: -4\nseed: 18446744073709551615\ngate_m: 1e-3\nfile: x y\n"
      "scope: paper\nwindow: {keyframes: 4}\n"
      "items:\n  - {id: 1, name: one}\n  - {id: 2}\n");
  EXPECT_FALSE(o.flag);
  EXPECT_EQ(o.count, -4);
  EXPECT_EQ(o.seed, 18446744073709551615U);
  EXPECT_EQ(o.gate_m, 1e-3);
  EXPECT_EQ(o.file, "x y");
  EXPECT_EQ(o.scope, Scope::kPaper);
  EXPECT_EQ(o.window.keyframes, 4);
  ASSERT_EQ(o.items.size(), 2U);
  EXPECT_EQ(o.items[1].id, 2);
  EXPECT_EQ(o.items[1].name, "none");
}

TEST(YamlOptions, EmptyTextKeepsAllDefaults) {
  EXPECT_EQ(Read("").count, 3);
  EXPECT_EQ(Read("# nothing\n").count, 3);
}

TEST(YamlOptions, AnOptionalSectionIsThereOnlyWhenGiven) {
  EXPECT_FALSE(Read("count: 4").extra);
  EXPECT_FALSE(Read("extra: ~").extra);
  EXPECT_EQ(Read("extra: {}").extra.value().name, "none");
  EXPECT_EQ(Read("extra: {id: 5}").extra.value().id, 5);
  EXPECT_THAT(Complaint("extra: {nam: x}"), HasSubstr("'extra.name'"));
  for (const char* text : {"count: 4", "extra: {id: 5}"}) {
    Options options = Read(text);
    YamlOptions yaml;
    Bind(yaml, options);
    EXPECT_EQ(Read(yaml.Print()).extra.has_value(), options.extra.has_value()) << yaml.Print();
  }
}

TEST(YamlOptions, AnOptionalNumberIsThereOnlyWhenGiven) {
  EXPECT_FALSE(Read("count: 4").bound);
  EXPECT_FALSE(Read("bound: ~").bound);
  EXPECT_EQ(Read("bound: 0").bound, 0.0);
  EXPECT_THAT(Complaint("bound: high"),
              HasSubstr("'bound' must be a number from 0 to 1, not 'high'"));
  for (const char* text : {"count: 4", "bound: 0.1"}) {
    Options options = Read(text);
    YamlOptions yaml;
    Bind(yaml, options);
    EXPECT_EQ(Read(yaml.Print()).bound, options.bound) << yaml.Print();
  }
}

TEST(YamlOptions, UnknownKeyNamesFileLineAndNearest) {
  EXPECT_THAT(Complaint("flag: true\ngate: 2\n"),
              AllOf(HasSubstr("test.yaml:2"), HasSubstr("unknown key 'gate'"),
                    HasSubstr("did you mean 'gate_m'?")));
  EXPECT_THAT(Complaint("gatem: 2\n"), Not(HasSubstr("count")));
  EXPECT_THAT(Complaint("xylophone: 2\n"),
              AllOf(HasSubstr("known are flag, count"), Not(HasSubstr("did you mean"))));
  EXPECT_THAT(Complaint("window: {keyframe: 2}"), HasSubstr("'window.keyframes'"));
  EXPECT_THAT(Complaint("items: [{id: 1}, {id: 2, nam: x}]"),
              AllOf(HasSubstr("'items[1].nam'"), HasSubstr("'items[1].name'")));
}

TEST(YamlOptions, WrongTypeNamesKeyAndExpectation) {
  EXPECT_THAT(Complaint("count: 1.5"),
              AllOf(HasSubstr("test.yaml:1"), HasSubstr("'count' must be a whole number"),
                    HasSubstr("'1.5'")));
  EXPECT_THAT(Complaint("count: '3'"), HasSubstr("whole number"));
  EXPECT_THAT(Complaint("seed: -1"), HasSubstr("whole number >= 0"));
  EXPECT_THAT(Complaint("flag: 3"), HasSubstr("true or false"));
  EXPECT_THAT(Complaint("gate_m: near"), HasSubstr("a number"));
  EXPECT_THAT(Complaint("gate_m: [1]"), HasSubstr("a number from 0 to 10, not a list"));
  EXPECT_THAT(Complaint("gate_m:"), HasSubstr("a number from 0 to 10, not nothing"));
  EXPECT_THAT(Complaint("scope: some"), HasSubstr("one of all, paper"));
  EXPECT_THAT(Complaint("window: 3"), HasSubstr("'window' must be a section of keys"));
  EXPECT_THAT(Complaint("items: {id: 3}"), HasSubstr("'items' must be a list"));
  EXPECT_THAT(Complaint("- 1"), HasSubstr("section of keys"));
}

TEST(YamlOptions, ARangeTakesItsEndsAndIsNamed) {
  double delay = 1;
  int32_t id = 1;
  std::optional<double> bound;
  YamlOptions yaml;
  yaml.AddBetween("delay", 0, 1e6, &delay);
  yaml.AddBetween("id", 1, 65535, &id);
  yaml.AddBetween("bound", 0, 1, &bound);
  yaml.ReadText("delay: 1e6\nid: 65535\nbound: 1", "test.yaml");
  EXPECT_EQ(delay, 1e6);
  EXPECT_EQ(id, 65535);
  EXPECT_EQ(bound, 1);
  yaml.ReadText("bound: ~", "test.yaml");
  EXPECT_FALSE(bound);
  const auto complaint = [&yaml](const std::string& text) -> std::string {
    try {
      yaml.ReadText(text, "test.yaml");
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(complaint("\ndelay: 1e300"),
            "test.yaml:2: key 'delay' must be a number from 0 to 1000000, not '1e300'");
  EXPECT_EQ(complaint("id: 65536"),
            "test.yaml:1: key 'id' must be a whole number from 1 to 65535, not '65536'");
  EXPECT_THAT(complaint("id: 1.5"), HasSubstr("'id' must be a whole number from 1 to 65535"));
  for (const char* text : {"bound: .nan", "bound: .inf", "bound: -0.1"}) {
    EXPECT_THAT(complaint(text), HasSubstr("'bound' must be a number from 0 to 1, not")) << text;
  }
  EXPECT_EQ(delay, 1e6);
}

TEST(YamlOptions, APairAndATextHaveTheirBounds) {
  double x = 1, y = 2.5;
  std::string text = "a: b";
  YamlOptions yaml;
  yaml.AddPairBetween("pixel", 0, 10, &x, &y);
  yaml.AddText("text", 4, &text);
  const std::string printed = yaml.Print();
  x = y = 0;
  text.clear();
  yaml.ReadText(printed, "printed");
  EXPECT_EQ(x, 1);
  EXPECT_EQ(y, 2.5);
  EXPECT_EQ(text, "a: b");
  const auto complaint = [&](const std::string& bad) -> std::string {
    try {
      yaml.ReadText(bad, "f.yaml");
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "taken";
  };
  EXPECT_EQ(complaint("pixel: [0, 10]\ntext: abcd\n"), "taken");
  EXPECT_EQ(complaint("pixel: [0, 10.1]"),
            "f.yaml:1: key 'pixel[1]' must be a number from 0 to 10, not '10.1'");
  EXPECT_EQ(complaint("pixel: 7"),
            "f.yaml:1: key 'pixel' must be a list of two numbers, each from 0 to 10, not '7'");
  EXPECT_EQ(complaint("text: abcde"),
            "f.yaml:1: key 'text' must be a text of at most 4 bytes, not 5");
}

TEST(YamlOptions, MissingDoubledAndBroken) {
  EXPECT_THAT(Complaint("items: [{name: x}]"), HasSubstr("key 'items[0].id' is missing"));
  EXPECT_THAT(Complaint("count: 1\ncount: 2"), HasSubstr("'count' stands twice"));
  EXPECT_THAT(Complaint("count: [1"), AllOf(HasSubstr("test.yaml"), HasSubstr("not YAML")));
}

TEST(YamlOptions, MissingFileIsNamed) {
  Options options;
  YamlOptions yaml;
  Bind(yaml, options);
  try {
    yaml.ReadFile("/nonexistent/options.yaml");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("/nonexistent/options.yaml"));
  }
}

TEST(YamlOptions, WhatIsPrintedReadsBackTheSame) {
  Options o;
  o.gate_m = 0.1 + 0.2;  // needs all 17 digits
  o.scope = Scope::kPaper;
  o.file = "x: y #";
  o.items = {{4, "four"}, {5, "five"}};
  YamlOptions yaml;
  Bind(yaml, o);
  const std::string printed = yaml.Print();
  const Options back = Read(printed);
  EXPECT_EQ(back.gate_m, o.gate_m);
  EXPECT_EQ(back.file, o.file);
  EXPECT_EQ(back.scope, o.scope);
  ASSERT_EQ(back.items.size(), 2U);
  EXPECT_EQ(back.items[1].name, "five");
  Options again = back;
  YamlOptions second;
  Bind(second, again);
  EXPECT_EQ(second.Print(), printed);
}

struct Described {
  int stride = 3;
  int64_t bytes = 4'000'000'000;
  double sigma_m = 0.1;
  bool equalise = true;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("stride", &stride, {1, 1000}, "", "every so many");
    archive.Add("bytes", &bytes, {1e6, 1e15}, "B", "");
    archive.Add("sigma_m", &sigma_m, {0.001, 10}, "m", "");
    archive.Add("equalise", &equalise, "the image first");
  }
};

struct Outer {
  Described check;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("check", &check, "of what is seen");
  }
};

TEST(YamlOptions, BoundsUnitAndHelpStandBesideTheValues) {
  Outer outer;
  YamlOptions yaml;
  outer.Visit(yaml);
  EXPECT_EQ(yaml.Print(),
            "check:  # of what is seen\n"
            "  stride: 3  # 1 to 1000: every so many\n"
            "  bytes: 4000000000  # 1000000 to 1000000000000000 B\n"
            "  sigma_m: 0.1  # 0.001 to 10 m\n"
            "  equalise: true  # the image first\n");
  EXPECT_EQ(yaml.PrintWithoutHelp(),
            "check:\n  stride: 3\n  bytes: 4000000000\n  sigma_m: 0.1\n  equalise: true\n");
  const std::string printed = yaml.Print();
  yaml.ReadText(printed, "printed");
  EXPECT_EQ(yaml.Print(), printed);
}

TEST(YamlOptions, OneValueIsSetByItsPath) {
  Outer outer;
  YamlOptions yaml;
  outer.Visit(yaml);
  yaml.Set("check.stride", "7");
  EXPECT_EQ(outer.check.stride, 7);
  EXPECT_EQ(yaml.Values().at("check.stride"), "7");
  const auto complaint = [&yaml](const std::string& path, const std::string& value) -> std::string {
    try {
      yaml.Set(path, value);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "taken";
  };
  EXPECT_EQ(complaint("check.stride", "0"),
            "--set: key 'check.stride' must be a whole number from 1 to 1000, not '0'");
  EXPECT_EQ(complaint("check.bytes", "12"),
            "--set: key 'check.bytes' must be a whole number from 1000000 to 1000000000000000, "
            "not '12'");
  EXPECT_EQ(complaint("stride", "7"), "no option 'stride'; did you mean 'check.stride'?");
  EXPECT_EQ(complaint("check.strid", "7"), "no option 'check.strid'; did you mean 'check.stride'?");
  EXPECT_EQ(outer.check.stride, 7);
}

TEST(YamlOptions, WhatAnotherVersionKnewIsLeftOutAndSaid) {
  Outer outer;
  YamlOptions yaml;
  outer.Visit(yaml);
  const std::string text = "check: {stride: 5, fate: 2, equalise: false}\nold: {a: 1}\n";
  EXPECT_THAT(yaml.ReadKnown(text, "old.lcm"), testing::ElementsAre("check.fate 2", "old"));
  EXPECT_EQ(outer.check.stride, 5);
  EXPECT_FALSE(outer.check.equalise);
  EXPECT_THROW(yaml.ReadText(text, "mine.yaml"), std::runtime_error);
  EXPECT_THROW(yaml.ReadKnown("check: {stride: 0}", "old.lcm"), std::runtime_error);
}

TEST(YamlOptions, BindingAKeyTwiceIsAProgrammersMistake) {
  YamlOptions yaml;
  bool value = false;
  yaml.Add("a", &value);
  EXPECT_THROW(yaml.Add("a", &value), std::logic_error);
  EXPECT_THROW(yaml.Require("b"), std::logic_error);
}

}  // namespace
}  // namespace pangea

#include "link_emulator/link_conditions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "options/yaml_options.h"

namespace pangea {
namespace {

using testing::HasSubstr;

TEST(LinkConditions, DefaultIsAPerfectLink) { EXPECT_EQ(Describe({}), "perfect"); }

TEST(LinkConditions, EveryNumberHasItsRange) {
  const auto complaint = [](const std::string& text) -> std::string {
    LinkConditions conditions;
    YamlOptions yaml;
    conditions.Visit(yaml);
    try {
      yaml.ReadText(text, "link.yaml");
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "nothing";
  };
  EXPECT_THAT(complaint("loss: 5"), HasSubstr("link.yaml:1: key 'loss' must be a number from 0 to "
                                              "1, not '5'"));
  EXPECT_THAT(complaint("reorder: -0.1"), HasSubstr("'reorder' must be a number from 0 to 1,"));
  EXPECT_THAT(complaint("duplicate: .nan"), HasSubstr("'duplicate' must be a number from 0 to 1,"));
  EXPECT_THAT(complaint("delay_ms: 1e300"),
              HasSubstr("'delay_ms' must be a number from 0 to 60000,"));
  EXPECT_THAT(complaint("jitter_ms: -1"),
              HasSubstr("'jitter_ms' must be a number from 0 to 60000,"));
  EXPECT_THAT(complaint("partitions: [{at: 30, seconds: -60}]"),
              HasSubstr("'partitions[0].seconds' must be a number from 0 to 1000000,"));
  EXPECT_THAT(complaint("partitions: [{at: .inf, seconds: 60}]"), HasSubstr("'partitions[0].at'"));
  EXPECT_THAT(complaint("seed: -1"), HasSubstr("'seed' must be a whole number >= 0"));
}

TEST(LinkConditions, ReadFromYamlAndDescribed) {
  LinkConditions conditions;
  YamlOptions yaml;
  conditions.Visit(yaml);
  yaml.ReadText("{loss: 0.05, delay_ms: 50, partitions: [{at: 30, seconds: 60}], seed: 7}", "test");
  EXPECT_EQ(conditions.seed, 7u);
  EXPECT_EQ(Describe(conditions), "loss 5 %, delay 50 ms, cut at 30 s for 60 s");

  LinkConditions again;
  YamlOptions yaml_again;
  again.Visit(yaml_again);
  yaml_again.ReadText(yaml.Print(), "printed");
  EXPECT_EQ(Describe(again), Describe(conditions));
}

}  // namespace
}  // namespace pangea

#include "link_emulator/link_conditions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "link_emulator/link_conditions_yaml.h"

namespace pangea {
namespace {

using testing::HasSubstr;

TEST(LinkConditions, DefaultIsAPerfectLink) {
  EXPECT_EQ(LinkConditions{}.Invalid(), std::nullopt);
  EXPECT_EQ(Describe({}), "perfect");
}

TEST(LinkConditions, SayWhatIsWrong) {
  const auto invalid = [](const LinkConditions& conditions) {
    return conditions.Invalid().value_or("nothing");
  };
  LinkConditions conditions;
  conditions.loss = 5;
  EXPECT_THAT(invalid(conditions), testing::AllOf(HasSubstr("loss 5"), HasSubstr("0 to 1")));
  conditions = {};
  conditions.duplicate = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(invalid(conditions), HasSubstr("duplicate"));
  conditions = {};
  conditions.jitter_ms = -1;
  EXPECT_THAT(invalid(conditions), HasSubstr("jitter_ms"));
  conditions = {};
  conditions.partitions = {{30, -60}};
  EXPECT_THAT(invalid(conditions), HasSubstr("partition"));
}

TEST(LinkConditions, ReadFromYamlAndDescribed) {
  LinkConditions conditions;
  YamlOptions yaml;
  Bind(yaml, conditions);
  yaml.ReadText("{loss: 0.05, delay_ms: 50, partitions: [{at: 30, seconds: 60}], seed: 7}", "test");
  EXPECT_EQ(conditions.seed, 7u);
  EXPECT_EQ(Describe(conditions), "loss 5 %, delay 50 ms, cut at 30 s for 60 s");

  LinkConditions again;
  YamlOptions yaml_again;
  Bind(yaml_again, again);
  yaml_again.ReadText(yaml.Print(), "printed");
  EXPECT_EQ(Describe(again), Describe(conditions));
}

}  // namespace
}  // namespace pangea

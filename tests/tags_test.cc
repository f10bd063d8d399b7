// AprilTags in rendered halls: agents that see the same tags are fused, and a hall that differs in
// nothing but its tags is another one.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>

#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;

class Tags : public testing::Test {
 protected:
  // The keyframes of an agent that walks through the hall with tags from this one on.
  fs::path Walked(int agent, int first_tag) const {
    const std::string name = fmt::format("{}_{}", agent, first_tag);
    const Outcome rendered = RunCommand(fmt::format(
        "pangea-sim --no-cache --generate walk --duration 16 --path-seed {0} --seed {0} "
        "--tags {1} --tag-size 0.8 --out {2}",
        agent, first_tag, (folder_ / name).string()));
    EXPECT_EQ(rendered.exit_code, 0) << rendered.output;
    const fs::path keyframes = folder_ / (name + ".lcm");
    const Outcome played = RunCommand(
        fmt::format("pangea-vio --agent {0} --bus none --recording {1} --rate max --map-utime {0} "
                    "--out-keyframes {2}",
                    agent, (folder_ / name).string(), keyframes.string()));
    EXPECT_EQ(played.exit_code, 0) << played.output;
    return keyframes;
  }

  nlohmann::json Fused(const fs::path& first, const fs::path& second) const {
    const fs::path options = folder_ / "options.yaml", out = folder_ / "out";
    std::ofstream(options) << "fusion: {alignment: {tags: [{ids: 0-299, size_m: 0.8}]}}\n";
    fs::remove_all(out);
    const Outcome replayed =
        RunCommand(fmt::format("pangea-session replay {} {} --options {} --out {}", first.string(),
                               second.string(), options.string(), out.string()));
    EXPECT_EQ(replayed.exit_code, 0) << replayed.output;
    EXPECT_EQ(replayed.output.find("taken apart"), std::string::npos) << replayed.output;
    return ReadJson(out / "report.json");
  }

  fs::path folder_ = FreshFolder("tags");
};

TEST_F(Tags, TheSameOnesFuseAndDifferentOnesNever) {
  const fs::path first = Walked(1, 0);
  const auto fused = Fused(first, Walked(2, 0));
  EXPECT_EQ(fused["groups"].size(), 1u);
  EXPECT_GE(fused["constraints"]["accepted_inter"], 10);
  // Everything but the tags is the same, even the places.
  EXPECT_EQ(Fused(first, Walked(2, 200))["groups"].size(), 2u);
  fs::remove_all(folder_);
}

}  // namespace
}  // namespace pangea::tests

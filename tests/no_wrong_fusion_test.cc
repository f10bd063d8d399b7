// Tests places that must never become one map: two different halls, and two rooms that share a
// dozen identical objects at different positions.

#include <gtest/gtest.h>

#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;

void RenderWalk(const fs::path& out, const std::string& arguments) {
  const Outcome rendered =
      RunCommand("pangea-sim --no-cache --shrink 2 --generate walk --duration 30 --out " +
                 out.string() + " " + arguments);
  ASSERT_EQ(rendered.exit_code, 0) << rendered.output;
}

// Without maps there would be no fusion either, so both agents must have one.
void ExpectBothMapped(const nlohmann::json& report) {
  ASSERT_EQ(report["agents"].size(), 2u);
  for (const auto& agent : report["agents"]) {
    EXPECT_EQ(agent["map_ids"].size(), 1u) << agent;
    EXPECT_GT(agent["keyframes"].get<int>(), 20) << agent;
  }
}

// `least_refused`: least number of constraints that recognition proposes and verification refuses.
void ExpectApart(const std::string& name, const std::string& first, const std::string& second,
                 int least_refused) {
  const fs::path folder = FreshFolder(name);
  RenderWalk(folder / "a", first);
  RenderWalk(folder / "b", second);
  const fs::path file = WriteSession(folder, {"id: 1, recording: a", "id: 2, recording: b"});
  const Outcome run = RunCommand("pangea-session run " + file.string() + " --out " +
                                 (folder / "out").string() + " --rate max");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const auto report = ReadJson(folder / "out" / "report.json");
  ExpectBothMapped(report);
  EXPECT_GE(report["constraints"]["refused"].get<int>(), least_refused) << run.output;
  EXPECT_EQ(report["constraints"]["accepted_inter"], 0) << run.output;
  ASSERT_EQ(report["groups"].size(), 2u) << run.output;
  for (const auto& group : report["groups"]) {
    EXPECT_EQ(group["agents"].size(), 1u) << run.output;
  }
  fs::remove_all(folder);
}

TEST(NoWrongFusion, DifferentHalls) {
  ExpectApart("halls", "--path-seed 1 --scene-seed 1", "--path-seed 1 --scene-seed 2", 0);
}

TEST(NoWrongFusion, RoomsWithIdenticalObjects) {
  ExpectApart("twins", "--path-seed 1 --scene twin_objects_a",
              "--path-seed 2 --scene twin_objects_b", 1);
}

}  // namespace
}  // namespace pangea::tests

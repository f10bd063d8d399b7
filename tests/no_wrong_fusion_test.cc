// What must never be one map: two different halls, and two rooms that share a dozen identical
// objects standing at different places.

#include <gtest/gtest.h>

#include "programs.h"

namespace pangea::tests {
namespace {

namespace fs = std::filesystem;

void ExpectApart(const std::string& name, const std::string& first, const std::string& second) {
  const fs::path folder = FreshFolder(name);
  RenderWalk(folder / "a", first);
  RenderWalk(folder / "b", second);
  const fs::path file = WriteSession(folder, {"id: 1, recording: a", "id: 2, recording: b"});
  const Outcome run = RunCommand("pangea-session run " + file.string() + " --out " +
                                 (folder / "out").string() + " --rate max");
  ASSERT_EQ(run.exit_code, 0) << run.output;
  const auto report = ReadJson(folder / "out" / "report.json");
  for (const auto& group : report["groups"]) {
    EXPECT_EQ(group["agents"].size(), 1u) << run.output;
  }
  fs::remove_all(folder);
}

TEST(NoWrongFusion, DifferentHalls) {
  ExpectApart("halls", "--generate walk --path-seed 1 --scene-seed 1 --duration 30",
              "--generate walk --path-seed 1 --scene-seed 2 --duration 30");
}

TEST(NoWrongFusion, RoomsWithIdenticalObjects) {
  ExpectApart("twins", "--generate walk --path-seed 1 --scene twin_objects_a --duration 30",
              "--generate walk --path-seed 2 --scene twin_objects_b --duration 30");
}

}  // namespace
}  // namespace pangea::tests

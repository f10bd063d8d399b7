// Tests what the import of a solved graph takes, moves back and refuses: other gauges, turned,
// scaled and contradicting poses.

#include "log_tools/solved_graph.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <stdexcept>

#include "g2o/graph_solver.h"
#include "log_tools/log_export.h"
#include "log_tools/log_import.h"
#include "log_tools/log_tools_test_world.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class SolvedGraphTest : public LogToolsTest {
 protected:
  void SetUp() override {
    LogToolsTest::SetUp();
    log_ = GraphOf(kSample).graph;
  }

  // Imports the graph; returns the log's poses afterwards.
  Graph Import(const Graph& graph) {
    std::ofstream(Path("solved.g2o")) << ToG2o(graph);
    fs::remove(Path("solved.lcm"));
    imported_ = ImportG2o(kSample, Path("solved.g2o"), Path("solved.lcm"));
    return GraphOf(Path("solved.lcm")).graph;
  }

  // Why it is refused; nothing is written then.
  std::string ErrorOf(const Graph& graph) {
    try {
      Import(graph);
    } catch (const std::runtime_error& error) {
      EXPECT_FALSE(fs::exists(Path("solved.lcm")));
      const std::string what = error.what();
      return what.substr(what.find("solved.g2o"));
    }
    return "no error";
  }

  static Graph Moved(Graph graph, const Rigid3& T) {
    for (auto& [vertex, pose] : graph.vertices) {
      pose = T * pose;
    }
    return graph;
  }

  static void ExpectPoses(const Graph& graph, const Graph& expected) {
    for (const auto& [vertex, pose] : expected.vertices) {
      EXPECT_LT(graph.vertices.at(vertex).Minus(pose).norm(), 1e-6) << vertex;
    }
  }

  Graph log_;
  ImportedG2o imported_;
};

TEST_F(SolvedGraphTest, ARigidTransformIsUndoneAtTheFixedVertex) {
  for (const Rigid3& T :
       {Rigid3{ExpSo3({M_PI / 2, 0, 0}), {0, 0, 0}}, Rigid3{ExpSo3({0, 0.1, 0}), {0, 0, 0}},
        Rigid3{YawRotation(2), {10, -20, 0.5}}, Rigid3{ExpSo3({2, 2, 0.5}), {3, 2, 1}}}) {
    ExpectPoses(Import(Moved(log_, T)), log_);
    EXPECT_NEAR(imported_.poses.cost_after / imported_.poses.cost_before, 1, 1e-4);
    EXPECT_THAT(imported_.poses.remarks,
                ElementsAre(HasSubstr("solved.g2o: the fixed vertex 0 is")));
  }
  Import(Moved(log_, {ExpSo3({M_PI / 2, 0, 0}), {0, 0, 0}}));
  EXPECT_THAT(imported_.poses.remarks, ElementsAre(HasSubstr(" and 90.00 deg from where")));
}

TEST_F(SolvedGraphTest, AFileWithoutFixIsPlacedByTheLogs) {
  Graph without = Moved(log_, {ExpSo3({M_PI / 2, 0, 0}), {0, 0, 0}});
  without.fixed.clear();
  ExpectPoses(Import(without), log_);
}

TEST_F(SolvedGraphTest, TheVertexThatTheFileFixesStays) {
  Graph other = log_;
  other.fixed = {40};
  const Rigid3 T{ExpSo3({0.02, 0, 0}), {0.1, 0, 0}};
  for (auto& [vertex, pose] : other.vertices) {
    pose = vertex == 40 ? pose : pose.Plus(1e-5 * Vector6d::Ones());
  }
  ExpectPoses(Import(Moved(other, T)), other);
}

// Least squares in six degrees of freedom moves roll and pitch a little.
TEST_F(SolvedGraphTest, AnotherSolversResultComesBackInAnyGauge) {
  Graph solved = log_;
  ASSERT_TRUE(SolveGraph(&solved).converged);
  ExpectPoses(Import(solved), solved);
  EXPECT_THAT(imported_.poses.remarks, IsEmpty());
  EXPECT_LT(imported_.poses.cost_after, imported_.poses.cost_before);
  // SE-Sync puts the first vertex at the identity.
  ExpectPoses(Import(Moved(solved, solved.vertices.at(0).Inverse())), solved);
}

TEST_F(SolvedGraphTest, AnotherScaleIsRefusedWithItsFactor) {
  for (const double scale : {2.0, 0.5, 1.1}) {
    Graph scaled = log_;
    for (auto& [vertex, pose] : scaled.vertices) {
      pose.t *= scale;
    }
    EXPECT_THAT(ErrorOf(scaled),
                HasSubstr(fmt::format("are {:.4g} times those of the log", scale)));
    EXPECT_THAT(ErrorOf(scaled), HasSubstr(fmt::format("divide the positions by {:.4g}", scale)));
  }
  Graph a_little = log_;
  const Eigen::Vector3d centre = log_.vertices.at(0).t;
  for (auto& [vertex, pose] : a_little.vertices) {
    pose.t = centre + 1.02 * (pose.t - centre);
  }
  Import(a_little);
  EXPECT_THAT(imported_.poses.remarks, ElementsAre(HasSubstr("are 1.020 times those of the log")));
}

TEST_F(SolvedGraphTest, RollAndPitchAreTheOdometrys) {
  Graph turned = Moved(log_, {ExpSo3({0.4, 0, 0}), {0, 0, 0}});
  turned.vertices.at(0) = log_.vertices.at(0);  // only the fixed vertex stayed
  EXPECT_THAT(ErrorOf(turned), HasSubstr("solved.g2o: vertex 1 is rotated by 22.9 deg in roll"));
}

TEST_F(SolvedGraphTest, PosesOfSomethingElseAreRefused) {
  Graph shuffled = log_;
  for (auto& [vertex, pose] : shuffled.vertices) {
    std::swap(pose.t.x(), pose.t.y());
  }
  EXPECT_THAT(ErrorOf(shuffled), HasSubstr("its poses contradict the log's own "));
}

}  // namespace
}  // namespace pangea

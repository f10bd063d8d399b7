// Tests pose graphs in g2o format: the sample's, and damaged ones.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "log_tools/log_export.h"
#include "log_tools/log_import.h"
#include "log_tools/log_tools_test_world.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;

// The error and its square as g2o's documentation has them, from the file's numbers alone.
double CostByG2o(const std::string& path) {
  std::ifstream file(path);
  std::map<int, Eigen::Isometry3d> vertices;
  const auto read_pose = [](std::istream& in) {
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    in >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w();
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(t);
    pose.rotate(q);
    return pose;
  };
  double cost = 0;
  std::string text;
  while (std::getline(file, text)) {
    std::istringstream line(text);
    std::string kind;
    line >> kind;
    if (kind == "VERTEX_SE3:QUAT") {
      int id = 0;
      line >> id;
      vertices[id] = read_pose(line);
    } else if (kind == "EDGE_SE3:QUAT") {
      int from = 0, to = 0;
      line >> from >> to;
      const Eigen::Isometry3d Z = read_pose(line);
      const Eigen::Isometry3d delta = Z.inverse() * (vertices[from].inverse() * vertices[to]);
      Eigen::Quaterniond q(delta.rotation());
      if (q.w() < 0) {
        q.coeffs() *= -1;
      }
      Eigen::Matrix<double, 6, 1> e;
      e << delta.translation(), q.vec();
      Eigen::Matrix<double, 6, 6> information;
      for (int row = 0; row < 6; ++row) {
        for (int column = row; column < 6; ++column) {
          line >> information(row, column);
          information(column, row) = information(row, column);
        }
      }
      cost += e.dot(information * e);
    }
  }
  return cost;
}

TEST_F(LogToolsTest, TheG2oFileHasOurCost) {
  const NamedGraph named = GraphOf(kSample);
  EXPECT_EQ(named.graph.vertices.size(), 63U);
  EXPECT_EQ(named.keyframes.size(), 63U);
  EXPECT_GT(named.graph.edges.size(), 80U);
  std::ofstream(Path("graph.g2o")) << ToG2o(named.graph);
  const double ours = Cost(named.graph);
  EXPECT_GT(ours, 1);
  EXPECT_NEAR(CostByG2o(Path("graph.g2o")) / ours, 1, 1e-3);
  const Graph again = ReadG2o(Path("graph.g2o"));
  EXPECT_EQ(again.edges.size(), named.graph.edges.size());
  EXPECT_EQ(again.fixed, named.graph.fixed);
  EXPECT_NEAR(Cost(again) / ours, 1, 1e-5);
}

// A report of the new log shows the other solver's poses; here the map is bent upwards.
TEST_F(LogToolsTest, AG2oFileComesBackIntoTheLog) {
  const NamedGraph named = GraphOf(kSample);
  Graph bent = named.graph;
  for (auto& [number, pose] : bent.vertices) {
    pose.t.z() += 0.002 * static_cast<double>(number);
  }
  std::ofstream(Path("bent.g2o")) << ToG2o(bent);
  const ImportedG2o imported = ImportG2o(kSample, Path("bent.g2o"), Path("bent.lcm"));
  EXPECT_EQ(imported.keyframes, 63);
  EXPECT_TRUE(imported.poses.remarks.empty());
  EXPECT_NEAR(imported.poses.cost_before / Cost(named.graph), 1, 1e-9);
  EXPECT_NEAR(imported.poses.cost_after / Cost(bent), 1, 1e-4);
  const NamedGraph again = GraphOf(Path("bent.lcm"));
  EXPECT_EQ(again.keyframes, named.keyframes);
  EXPECT_EQ(again.graph.edges.size(), named.graph.edges.size());
  for (const auto& [number, pose] : bent.vertices) {
    EXPECT_LT(again.graph.vertices.at(number).Minus(pose).norm(), 1e-7);
  }
  // A second import adds nothing: the newest state counts.
  std::ofstream(Path("graph.g2o")) << ToG2o(named.graph);
  ImportG2o(Path("bent.lcm"), Path("graph.g2o"), Path("back.lcm"));
  EXPECT_NEAR(Cost(GraphOf(Path("back.lcm")).graph) / Cost(named.graph), 1, 1e-5);
}

TEST_F(LogToolsTest, AG2oFileOfAnotherLogIsRefused) {
  const auto error_of = [this](const Graph& graph) {
    std::ofstream(Path("other.g2o")) << ToG2o(graph);
    try {
      ImportG2o(kSample, Path("other.g2o"), Path("other.lcm"));
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  Graph graph = GraphOf(kSample).graph;
  graph.edges.clear();
  graph.vertices.emplace(63, Rigid3());
  EXPECT_NE(error_of(graph).find("vertex 63 is none of the log's 63 keyframes"), std::string::npos);
  graph.vertices.erase(63);
  graph.vertices.erase(7);
  EXPECT_NE(error_of(graph).find("vertex 7, keyframe 1/"), std::string::npos) << error_of(graph);
  EXPECT_FALSE(fs::exists(Path("other.lcm")));
}

// A pose that is invalid in a message would be refused by readers of the log, which would then use
// the old ones.
TEST_F(LogToolsTest, APoseThatNoMessageMayCarryIsNotTaken) {
  Graph graph = GraphOf(kSample).graph;
  graph.vertices.at(5).t.y() = 1e9;
  std::ofstream(Path("far.g2o")) << ToG2o(graph);
  EXPECT_THAT([this] { ImportG2o(kSample, Path("far.g2o"), Path("far.lcm")); },
              testing::ThrowsMessage<std::runtime_error>(
                  testing::HasSubstr("far.g2o:6: y 1e+09 is not from -100000 to 100000")));
  EXPECT_FALSE(fs::exists(Path("far.lcm")));
}

class BadG2oTest : public LogToolsTest {
 protected:
  static constexpr const char* kVertices =
      "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\n";
  // A diagonal information matrix, its last element given.
  static std::string Edge(const std::string& ends, const std::string& last) {
    return "EDGE_SE3:QUAT " + ends + " 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 " +
           last + "\n";
  }
  std::string ErrorOf(const std::string& text) {
    std::ofstream(Path("bad.g2o")) << text;
    try {
      return fmt::format("cost {}", Cost(ReadG2o(Path("bad.g2o"))));
    } catch (const std::runtime_error& error) {
      const std::string what = error.what();
      return what.substr(std::min(what.find("bad.g2o"), what.size()));
    }
  }
};

TEST_F(BadG2oTest, NamesLineAndField) {
  const std::string good = kVertices;
  EXPECT_EQ(ErrorOf(good + Edge("0 1", "1")), "cost 0");
  EXPECT_THAT(ErrorOf("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE2 1 0 0 0\n"),
              testing::StartsWith("bad.g2o:2: VERTEX_SE2"));
  EXPECT_EQ(ErrorOf("VERTEX_SE3:QUAT 0 0 nan 0 0 0 0 1\n"),
            "bad.g2o:1: y 'nan' is not a finite number");
  EXPECT_EQ(ErrorOf("VERTEX_SE3:QUAT 0 0 0 1e400 0 0 0 1\n"),
            "bad.g2o:1: z '1e400' is not a finite number");
  EXPECT_EQ(ErrorOf("VERTEX_SE3:QUAT 0 0 0 0 0 0 1\n"), "bad.g2o:1: qw is missing");
  EXPECT_EQ(ErrorOf("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1 7\n"),
            "bad.g2o:1: '7' stands behind the last field");
  EXPECT_EQ(ErrorOf("VERTEX_SE3:QUAT 0.5 0 0 0 0 0 0 1\n"),
            "bad.g2o:1: the id '0.5' is no vertex' number");
  EXPECT_THAT(ErrorOf("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 0\n"), testing::HasSubstr("not a rotation"));
  EXPECT_EQ(ErrorOf("\x1b[2J\xff" + std::string(100, 'a') + "\n"),
            "bad.g2o:1: ?[2J?" + std::string(35, 'a') +
                "... is none of VERTEX_SE3:QUAT, EDGE_SE3:QUAT, EDGE_SE3_OFFSET, FIX, "
                "PARAMS_SE3OFFSET");
}

TEST_F(BadG2oTest, NothingIsThereTwiceOrNowhere) {
  const std::string good = kVertices;
  EXPECT_EQ(ErrorOf(good + "VERTEX_SE3:QUAT 0 5 0 0 0 0 0 1\n"),
            "bad.g2o:3: vertex 0 is there already, in line 1");
  EXPECT_EQ(ErrorOf(good + Edge("0 1", "1") + Edge("0 1", "1")),
            "bad.g2o:4: edge 0 -> 1 is there already, the same, in line 3");
  EXPECT_EQ(ErrorOf(good + Edge("0 1", "1") + Edge("0 1", "2")), "cost 0");  // two measurements
  EXPECT_EQ(ErrorOf(Edge("0 7", "1") + good),
            "bad.g2o:1: an end of the edge, 7, is no vertex of the file");
  EXPECT_EQ(ErrorOf(good + Edge("1 1", "1")), "bad.g2o:3: the edge's ends are both 1");
  EXPECT_EQ(ErrorOf(good + "FIX 0 2\n"), "bad.g2o:3: to be fixed, 2, is no vertex of the file");
}

TEST_F(BadG2oTest, AnInformationMatrixIsPositiveDefinite) {
  const std::string good = kVertices;
  for (const char* last : {"0", "-1", "1e-40"}) {
    EXPECT_EQ(ErrorOf(good + Edge("0 1", last)),
              "bad.g2o:3: the information matrix is not positive definite")
        << last;
  }
  EXPECT_EQ(ErrorOf(good + Edge("0 1", "nan")),
            "bad.g2o:3: information 6,6 'nan' is not a finite number");
  EXPECT_THAT(ErrorOf(good + Edge("0 1", "1e300")),
              testing::StartsWith("bad.g2o:3: information 6,6 1e300 is not from"));
}

// g2o writes an offset into every file that it saves.
TEST_F(BadG2oTest, OffsetsOfSensorsAreRead) {
  const std::string good = "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n" + std::string(kVertices);
  EXPECT_EQ(ErrorOf(good + Edge("0 1", "1")), "cost 0");
  const auto offset_edge = [](const std::string& offsets, const std::string& z) {
    return "EDGE_SE3_OFFSET 0 1 " + offsets + " " + z +
           " 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n";
  };
  EXPECT_EQ(ErrorOf(good + offset_edge("0 0", "1 0")), "cost 0");
  // A sensor 0.5 m in front of the second body is 1.5 m from the first; parameters may come last.
  const std::string ahead = "PARAMS_SE3OFFSET 7 0.5 0 0 0 0 0 1\n";
  EXPECT_EQ(ErrorOf(good + offset_edge("0 7", "1.5 0") + ahead), "cost 0");
  EXPECT_EQ(ErrorOf(good + offset_edge("7 0", "0.5 0") + ahead), "cost 0");
  EXPECT_THAT(ErrorOf(good + offset_edge("0 7", "1 0") + ahead), testing::StartsWith("cost 0.25"));
  EXPECT_EQ(ErrorOf(good + offset_edge("0 7", "1 0")),
            "bad.g2o:4: the second end's offset, 7, is no PARAMS_SE3OFFSET of the file");
  EXPECT_EQ(ErrorOf(good + ahead + ahead), "bad.g2o:5: parameter 7 is there already, in line 4");
  EXPECT_EQ(ErrorOf("PARAMS_SE3OFFSET 0 0 0 0 0 0 1\n"), "bad.g2o:1: qw is missing");
}

// g2o's error (edge_se3_offset) at a small deviation, by its definition.
TEST_F(BadG2oTest, AnOffsetEdgeHasG2osCost) {
  const Rigid3 T_from_sensor{ExpSo3({0.3, -0.2, 0.5}), {0.1, 0.2, -0.3}};
  const Rigid3 T_to_sensor{ExpSo3({-0.4, 0.1, 0.2}), {0.5, -0.1, 0.2}};
  const Rigid3 from{ExpSo3({0.1, 0.7, -0.2}), {1, 2, 3}}, to{ExpSo3({-0.2, 0.3, 0.9}), {2, 1, 3}};
  Vector6d xi;
  xi << 2e-4, -1e-4, 3e-4, -1e-4, 2e-4, 1e-4;
  const Rigid3 Z = ((from * T_from_sensor).Inverse() * to * T_to_sensor).Plus(xi);
  const auto text_of = [](const Rigid3& T) {
    return fmt::format("{:.15g} {:.15g} {:.15g} {:.15g} {:.15g} {:.15g} {:.15g}", T.t.x(), T.t.y(),
                       T.t.z(), T.q.x(), T.q.y(), T.q.z(), T.q.w());
  };
  std::ofstream(Path("offset.g2o"))
      << "PARAMS_SE3OFFSET 1 " << text_of(T_from_sensor) << "\nPARAMS_SE3OFFSET 2 "
      << text_of(T_to_sensor) << "\nVERTEX_SE3:QUAT 0 " << text_of(from) << "\nVERTEX_SE3:QUAT 1 "
      << text_of(to) << "\nEDGE_SE3_OFFSET 0 1 1 2 " << text_of(Z)
      << " 10 1 0 0 2 0 20 0 0 0 0 30 0 1 0 400 0 0 500 0 600\n";
  const Rigid3 delta = Z.Inverse() * (from * T_from_sensor).Inverse() * to * T_to_sensor;
  Vector6d e;
  e << delta.t, (delta.q.w() < 0 ? -1 : 1) * delta.q.vec();
  Matrix6d information = Vector6d(10, 20, 30, 400, 500, 600).asDiagonal();
  information(0, 1) = information(1, 0) = 1;
  information(0, 4) = information(4, 0) = 2;
  information(2, 4) = information(4, 2) = 1;
  EXPECT_NEAR(Cost(ReadG2o(Path("offset.g2o"))) / e.dot(information * e), 1, 1e-2);
}

TEST_F(BadG2oTest, WhatElseRefersToAnOffsetIsRefusedByItsLine) {
  const std::string good = "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n" + std::string(kVertices);
  EXPECT_THAT(ErrorOf(good + "EDGE_SE3_PRIOR 0 0 0 0 0 0 0 0 1\n"),
              testing::StartsWith("bad.g2o:4: EDGE_SE3_PRIOR measures one vertex by itself"));
  EXPECT_THAT(ErrorOf(good + "VERTEX_TRACKXYZ 2 0 0 0\n"),
              testing::StartsWith("bad.g2o:4: VERTEX_TRACKXYZ is of a landmark"));
  EXPECT_THAT(ErrorOf(good + "EDGE_SE3_TRACKXYZ 0 2 0 0 0 0 1 0 0 1 0 1\n"),
              testing::StartsWith("bad.g2o:4: EDGE_SE3_TRACKXYZ is of a landmark"));
}

// GTSAM numbers vertices by a letter in the highest byte.
TEST_F(BadG2oTest, VerticesMayHaveNumbersOf63Bits) {
  const std::string a = "6989586621679009792", b = "7061644215716937728";
  const std::string text = "VERTEX_SE3:QUAT " + a + " 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT " + b +
                           " 1 0 0 0 0 0 1\n" + Edge(a + " " + b, "1");
  EXPECT_EQ(ErrorOf(text).substr(0, 5), "cost ");
  EXPECT_EQ(ErrorOf("VERTEX_SE3:QUAT 9989586621679009792 0 0 0 0 0 0 1\n"),
            "bad.g2o:1: the id '9989586621679009792' is no vertex' number");
}

}  // namespace
}  // namespace pangea

#include "log_tools/g2o.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace pangea::session {
namespace {

// d e / d xi: e's translation is in the measurement's frame, and its rotation part half an angle.
Matrix6d ErrorOfTangent(const Rigid3& T_from_to) {
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = T_from_to.R().transpose();
  J.bottomRightCorner<3, 3>() = 0.5 * T_from_to.R().transpose();
  return J;
}

std::string Pose(const Rigid3& pose) {
  return fmt::format("{:.9g} {:.9g} {:.9g} {:.12g} {:.12g} {:.12g} {:.12g}", pose.t.x(), pose.t.y(),
                     pose.t.z(), pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w());
}

// One line's fields, or what is wrong with them.
class Line {
 public:
  Line(const std::string& path, int number, const std::string& text)
      : path_(path), number_(number), stream_(text) {}

  std::string Word() {
    std::string word;
    stream_ >> word;
    return word;
  }
  int Vertex() {
    int id = 0;
    if (!(stream_ >> id)) {
      Fail("a vertex' number is missing");
    }
    return id;
  }
  double Number() {
    double value = 0;
    if (!(stream_ >> value)) {
      Fail("a number is missing or unreadable");
    }
    return value;
  }
  Rigid3 Pose() {
    Rigid3 pose;
    for (double& value : pose.t) {
      value = Number();
    }
    const double x = Number(), y = Number(), z = Number(), w = Number();
    pose.q = Eigen::Quaterniond(w, x, y, z);
    if (pose.q.norm() < 0.5) {
      Fail("the quaternion (x y z w) is not a rotation");
    }
    pose.q.normalize();
    return pose;
  }
  // Upper triangle, row by row.
  Matrix6d Information() {
    Matrix6d information;
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) {
        information(row, column) = information(column, row) = Number();
      }
    }
    return information;
  }
  [[noreturn]] void Fail(const std::string& what) const {
    throw std::runtime_error(fmt::format("{}:{}: {}", path_, number_, what));
  }

 private:
  const std::string& path_;
  int number_;
  std::istringstream stream_;
};

GraphEdge ReadEdge(Line* line) {
  GraphEdge edge;
  edge.from = line->Vertex();
  edge.to = line->Vertex();
  edge.T_from_to = line->Pose();
  const Matrix6d information = line->Information();
  if (information.llt().info() != Eigen::Success) {
    line->Fail("the information matrix is not positive definite");
  }
  const Matrix6d inverse = ErrorOfTangent(edge.T_from_to).inverse();
  edge.covariance = inverse * information.inverse() * inverse.transpose();
  return edge;
}

}  // namespace

double Cost(const Graph& graph) {
  double cost = 0;
  for (const GraphEdge& edge : graph.edges) {
    const Rigid3 T_from_to = graph.vertices.at(edge.from).Inverse() * graph.vertices.at(edge.to);
    const Vector6d xi = T_from_to.Minus(edge.T_from_to);
    cost += xi.dot(edge.covariance.ldlt().solve(xi));
  }
  return cost;
}

std::string ToG2o(const Graph& graph) {
  std::string text;
  for (const auto& [id, pose] : graph.vertices) {
    text += fmt::format("VERTEX_SE3:QUAT {} {}\n", id, Pose(pose));
  }
  for (const int id : graph.fixed) {
    text += fmt::format("FIX {}\n", id);
  }
  for (const GraphEdge& edge : graph.edges) {
    const Matrix6d J = ErrorOfTangent(edge.T_from_to);
    const Matrix6d information = (J * edge.covariance * J.transpose()).inverse();
    text += fmt::format("EDGE_SE3:QUAT {} {} {}", edge.from, edge.to, Pose(edge.T_from_to));
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) {
        text += fmt::format(" {:.12g}", information(row, column));
      }
    }
    text += "\n";
  }
  return text;
}

Graph ReadG2o(const std::string& path) {
  std::ifstream file(path);
  if (!file) {
    throw std::runtime_error(fmt::format("{}: cannot be read", path));
  }
  Graph graph;
  std::string text;
  for (int number = 1; std::getline(file, text); ++number) {
    Line line(path, number, text);
    const std::string kind = line.Word();
    if (kind == "VERTEX_SE3:QUAT") {
      const int id = line.Vertex();
      graph.vertices[id] = line.Pose();
    } else if (kind == "FIX") {
      graph.fixed.push_back(line.Vertex());
    } else if (kind == "EDGE_SE3:QUAT") {
      graph.edges.push_back(ReadEdge(&line));
    } else if (!kind.empty() && !kind.starts_with('#')) {
      line.Fail(fmt::format("{} is none of VERTEX_SE3:QUAT, EDGE_SE3:QUAT, FIX", kind));
    }
  }
  for (const GraphEdge& edge : graph.edges) {
    if (!graph.vertices.contains(edge.from) || !graph.vertices.contains(edge.to)) {
      throw std::runtime_error(
          fmt::format("{}: edge {} -> {} has an end that is no vertex", path, edge.from, edge.to));
    }
  }
  return graph;
}

}  // namespace pangea::session

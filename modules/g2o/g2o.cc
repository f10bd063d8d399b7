#include "g2o/g2o.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "files/csv.h"

#include "files/text_file.h"

namespace pangea {
namespace {

// de/dxi: the translation of e is in the measurement's frame, its rotation part is half an angle.
// With sensors, e is (t, q_xyz) of Z^-1 (T_from T_from_sensor)^-1 (T_to T_to_sensor); it does not
// depend on the first sensor.
Matrix6d ErrorOfTangent(const Rigid3& T_from_to, const Rigid3& T_to_sensor = Rigid3()) {
  const Eigen::Matrix3d R = (T_from_to.R() * T_to_sensor.R()).transpose();
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = R;
  J.topRightCorner<3, 3>() = -R * Hat(T_from_to.q * T_to_sensor.t);
  J.bottomRightCorner<3, 3>() = 0.5 * R;
  return J;
}

std::string Pose(const Rigid3& pose) {
  return fmt::format("{:.9g} {:.9g} {:.9g} {:.12g} {:.12g} {:.12g} {:.12g}", pose.t.x(), pose.t.y(),
                     pose.t.z(), pose.q.x(), pose.q.y(), pose.q.z(), pose.q.w());
}

constexpr double kMaxInformation = 1e30;
// Limit for a matrix with its diagonal scaled to one: below it, the inverse would be noise.
constexpr double kMinEigenvalue = 1e-13;

// Independent of the units of the rows.
bool PositiveDefinite(const Matrix6d& m) {
  if (!m.allFinite() || m.diagonal().minCoeff() < 1 / kMaxInformation) {
    return false;
  }
  const Vector6d scale = m.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6d scaled = scale.asDiagonal() * m * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(scaled, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().minCoeff() > kMinEigenvalue;
}

Matrix6d InverseOf(const Matrix6d& m) {
  const Vector6d scale = m.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6d scaled = scale.asDiagonal() * m * scale.asDiagonal();
  return scale.asDiagonal() * scaled.llt().solve(Matrix6d::Identity()) * scale.asDiagonal();
}

// Makes a word of any file printable on a terminal.
std::string Shown(std::string word) {
  constexpr size_t kMaxShown = 40;
  std::ranges::replace_if(
      word, [](unsigned char c) { return c < 0x20 || c > 0x7e; }, '?');
  return word.size() <= kMaxShown ? word : word.substr(0, kMaxShown) + "...";
}

// Parses the fields of one line; throws for an error.
class Line {
 public:
  Line(const std::string& path, int number, const std::string& text)
      : path_(path), number_(number), stream_(text) {}

  int number() const { return number_; }
  std::string Word() {
    std::string word;
    stream_ >> word;
    return word;
  }
  bool AtEnd() { return (stream_ >> std::ws).eof(); }
  int64_t Vertex(const std::string& field) { return Id(field, "vertex'"); }
  int64_t Id(const std::string& field, const std::string& of) {
    const std::string word = Word();
    int64_t id = 0;
    if (!ParseNumber(word, &id) || id < 0) {
      Fail(fmt::format("{} '{}' is no {} number", field, Shown(word), of));
    }
    return id;
  }
  double Number(const std::string& field, double most) {
    const std::string word = Word();
    double value = 0;
    if (!ParseNumber(word, &value)) {
      Fail(word.empty() ? field + " is missing"
                        : fmt::format("{} '{}' is not a finite number", field, Shown(word)));
    }
    if (std::abs(value) > most) {
      Fail(fmt::format("{} {} is not from {} to {}", field, word, -most, most));
    }
    return value;
  }
  Rigid3 Pose(double max_position_m) {
    Rigid3 pose;
    for (int i = 0; i < 3; ++i) {
      pose.t[i] = Number(std::string(1, "xyz"[i]), max_position_m);
    }
    Eigen::Vector4d q;  // in the order of Eigen and of g2o: x y z w
    for (int i = 0; i < 4; ++i) {
      q[i] = Number(std::string("q") + "xyzw"[i], 2);
    }
    if (q.norm() < 0.5) {
      Fail("the quaternion (qx qy qz qw) is not a rotation");
    }
    pose.q = Eigen::Quaterniond(q).normalized();
    return pose;
  }
  // The upper triangle, row by row.
  Matrix6d Information() {
    Matrix6d information;
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) {
        information(row, column) = information(column, row) =
            Number(fmt::format("information {},{}", row + 1, column + 1), kMaxInformation);
      }
    }
    return information;
  }
  void End() {
    if (!AtEnd()) {
      Fail(fmt::format("'{}' stands behind the last field", Shown(Word())));
    }
  }
  [[noreturn]] void Fail(const std::string& what) const { FailAt(path_, number_, what); }

  [[noreturn]] static void FailAt(const std::string& path, int number, const std::string& what) {
    throw std::runtime_error(fmt::format("{}:{}: {}", path, number, what));
  }

 private:
  const std::string& path_;
  int number_;
  std::istringstream stream_;
};

class Reader {
 public:
  Reader(const std::string& path, double max_position_m)
      : path_(path), max_position_m_(max_position_m) {}

  // Parameters come first: edges refer to them.
  void TakeParameter(Line line) {
    if (line.Word() == "PARAMS_SE3OFFSET") {
      const int64_t id = line.Id("the id", "parameter's");
      if (const auto [first, is_new] = parameter_lines_.emplace(id, line.number()); !is_new) {
        line.Fail(fmt::format("parameter {} is there already, in line {}", id, first->second));
      }
      offsets_[id] = line.Pose(max_position_m_);
      line.End();
    }
  }

  void Take(Line line) {
    const std::string kind = line.Word();
    if (kind == "VERTEX_SE3:QUAT") {
      TakeVertex(&line);
    } else if (kind == "FIX") {
      TakeFixed(&line);
    } else if (kind == "EDGE_SE3:QUAT" || kind == "EDGE_SE3_OFFSET") {
      TakeEdge(&line, kind == "EDGE_SE3_OFFSET");
    } else if (kind.starts_with("EDGE_SE3_PRIOR") || kind.starts_with("EDGE_SE3_XYZPRIOR")) {
      line.Fail(
          fmt::format("{} measures one vertex by itself, which is not read: fix the vertex "
                      "(FIX) in place of it, or leave it out",
                      Shown(kind)));
    } else if (kind.starts_with("VERTEX_TRACKXYZ") || kind.starts_with("EDGE_SE3_TRACKXYZ")) {
      line.Fail(fmt::format("{} is of a landmark: only graphs of poses are read", Shown(kind)));
    } else if (!kind.empty() && !kind.starts_with('#') && kind != "PARAMS_SE3OFFSET") {
      line.Fail(
          fmt::format("{} is none of VERTEX_SE3:QUAT, EDGE_SE3:QUAT, EDGE_SE3_OFFSET, FIX, "
                      "PARAMS_SE3OFFSET",
                      Shown(kind)));
    }
  }

  // Checks the edges at the end: a file may have edges before their vertices.
  Graph Finish() {
    for (size_t i = 0; i < graph_.edges.size(); ++i) {
      for (const int64_t id : {graph_.edges[i].from, graph_.edges[i].to}) {
        CheckVertex(id, edge_lines_[i], "an end of the edge");
      }
    }
    for (size_t i = 0; i < graph_.fixed.size(); ++i) {
      CheckVertex(graph_.fixed[i], fixed_lines_[i], "to be fixed");
    }
    return std::move(graph_);
  }

 private:
  void TakeVertex(Line* line) {
    const int64_t id = line->Vertex("the id");
    if (const auto [first, is_new] = vertex_lines_.emplace(id, line->number()); !is_new) {
      line->Fail(fmt::format("vertex {} is there already, in line {}", id, first->second));
    }
    graph_.vertices[id] = line->Pose(max_position_m_);
    line->End();
  }

  void TakeFixed(Line* line) {
    do {
      graph_.fixed.push_back(line->Vertex("the id"));
      fixed_lines_.push_back(line->number());
    } while (!line->AtEnd());
  }

  Rigid3 Offset(Line* line, const std::string& field) {
    const int64_t id = line->Id(field, "parameter's");
    const auto offset = offsets_.find(id);
    if (offset == offsets_.end()) {
      line->Fail(fmt::format("{}, {}, is no PARAMS_SE3OFFSET of the file", field, id));
    }
    return offset->second;
  }

  void TakeEdge(Line* line, bool with_offsets) {
    GraphEdge edge;
    edge.from = line->Vertex("the first end");
    edge.to = line->Vertex("the second end");
    if (edge.from == edge.to) {
      line->Fail(fmt::format("the edge's ends are both {}", edge.from));
    }
    Rigid3 T_from_sensor, T_to_sensor;
    if (with_offsets) {
      T_from_sensor = Offset(line, "the first end's offset");
      T_to_sensor = Offset(line, "the second end's offset");
    }
    edge.T_from_to = line->Pose(max_position_m_);
    if (with_offsets) {
      edge.T_from_to = T_from_sensor * edge.T_from_to * T_to_sensor.Inverse();
    }
    const Matrix6d information = line->Information();
    line->End();
    if (!PositiveDefinite(information)) {
      line->Fail("the information matrix is not positive definite");
    }
    const Matrix6d inverse = ErrorOfTangent(edge.T_from_to, T_to_sensor).inverse();
    edge.covariance = inverse * InverseOf(information) * inverse.transpose();
    if (!PositiveDefinite(edge.covariance)) {
      line->Fail("the information matrix cannot be inverted: its shares differ too much");
    }
    CheckNew(edge, *line);
    edges_between_[{edge.from, edge.to}].push_back(graph_.edges.size());
    edge_lines_.push_back(line->number());
    graph_.edges.push_back(edge);
  }

  void CheckNew(const GraphEdge& edge, const Line& line) {
    for (const size_t i : edges_between_[{edge.from, edge.to}]) {
      const GraphEdge& other = graph_.edges[i];
      if (other.T_from_to.t == edge.T_from_to.t &&
          other.T_from_to.q.coeffs() == edge.T_from_to.q.coeffs() &&
          other.covariance == edge.covariance) {
        line.Fail(fmt::format("edge {} -> {} is there already, the same, in line {}", edge.from,
                              edge.to, edge_lines_[i]));
      }
    }
  }

  void CheckVertex(int64_t id, int line, const std::string& what) const {
    if (!graph_.vertices.contains(id)) {
      Line::FailAt(path_, line, fmt::format("{}, {}, is no vertex of the file", what, id));
    }
  }

  const std::string& path_;
  const double max_position_m_;
  Graph graph_;
  std::map<int64_t, Rigid3> offsets_;       // T_body_sensor by parameter
  std::map<int64_t, int> parameter_lines_;  // by parameter
  std::map<int64_t, int> vertex_lines_;     // by vertex
  std::vector<int> fixed_lines_;            // parallel to graph_.fixed
  std::vector<int> edge_lines_;             // parallel to graph_.edges
  std::map<std::pair<int64_t, int64_t>, std::vector<size_t>> edges_between_;
};

}  // namespace

std::string ToG2o(const Graph& graph) {
  std::string text;
  for (const auto& [id, pose] : graph.vertices) {
    text += fmt::format("VERTEX_SE3:QUAT {} {}\n", id, Pose(pose));
  }
  for (const int64_t id : graph.fixed) {
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

Graph ReadG2o(const std::string& path, double max_position_m) {
  std::ifstream file = OpenFile(path);
  std::vector<std::string> lines;
  for (std::string text; std::getline(file, text);) {
    lines.push_back(std::move(text));
  }
  Reader reader(path, max_position_m);
  int number = 0;
  for (const std::string& text : lines) {
    reader.TakeParameter(Line(path, ++number, text));
  }
  number = 0;
  for (const std::string& text : lines) {
    reader.Take(Line(path, ++number, text));
  }
  return reader.Finish();
}

}  // namespace pangea

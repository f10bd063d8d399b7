#include "g2o/rotation_averaging.h"

#include <Eigen/LU>
#include <functional>
#include <optional>

#include "block_equations/block_equations.h"
#include "core/nearest_rotation.h"

namespace pangea {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Weights of an edge without regard to direction.
double RotationWeight(const GraphEdge& edge) {
  return 3 / edge.covariance.bottomRightCorner<3, 3>().trace();
}
double PositionWeight(const GraphEdge& edge) {
  return 3 / edge.covariance.topLeftCorner<3, 3>().trace();
}

// One edge of the least-squares problem  min sum weight |x_to - M x_from - c|^2.
struct LinearEdge {
  double weight = 1;
  Matrix3d M;
  Vector3d c;
};

// Solves it for the vertices with a variable; x of the others is given. False if that is not
// possible.
bool SolveLinear(const GraphIndices& indices, const std::function<LinearEdge(size_t edge)>& edge_of,
                 std::vector<Vector3d>* x) {
  BlockEquations equations(std::vector<int>(indices.num_variables(), 3), indices.cliques());
  for (size_t i = 0; i < indices.ends().size(); ++i) {
    const auto& [from, to] = indices.ends()[i];
    const int var_from = indices.VariableOf(from), var_to = indices.VariableOf(to);
    const auto& [weight, M, c] = edge_of(i);
    const bool both = var_from != GraphIndices::kStays && var_to != GraphIndices::kStays;
    // The residual where the unknown x are zero.
    Vector3d r = -c;
    r += var_to == GraphIndices::kStays ? (*x)[to] : Vector3d::Zero();
    r -= var_from == GraphIndices::kStays ? Vector3d(M * (*x)[from]) : Vector3d::Zero();
    const size_t place_from = both && var_from > var_to ? 1 : 0;
    const size_t place_to = both && var_to > var_from ? 1 : 0;
    if (var_from != GraphIndices::kStays) {
      equations.Add(i, place_from, place_from, Matrix3d(weight * M.transpose() * M));
      equations.g().segment<3>(equations.ColumnOf(var_from)) -= weight * M.transpose() * r;
    }
    if (var_to != GraphIndices::kStays) {
      equations.Add(i, place_to, place_to, Matrix3d(weight * Matrix3d::Identity()));
      equations.g().segment<3>(equations.ColumnOf(var_to)) += weight * r;
    }
    if (both) {
      const Matrix3d to_from = -weight * M;
      equations.Add(i, 1, 0, var_to > var_from ? to_from : Matrix3d(to_from.transpose()));
    }
  }
  const std::optional<Eigen::VectorXd> solved = equations.Solve();
  for (size_t vertex = 0; solved && vertex < indices.num_vertices(); ++vertex) {
    if (const int variable = indices.VariableOf(static_cast<int>(vertex));
        variable != GraphIndices::kStays) {
      (*x)[vertex] = solved->segment<3>(equations.ColumnOf(variable));
    }
  }
  return solved.has_value();
}

// The rows of all rotations: R_to = R_from R_from_to, so row k of R_to, as a column, is R_from_to^T
// times that of R_from.
bool AverageRotations(const Graph& graph, const GraphIndices& indices, std::vector<Rigid3>* poses) {
  std::vector<Matrix3d> rotations(poses->size());
  for (int row = 0; row < 3; ++row) {
    std::vector<Vector3d> x;
    for (const Rigid3& pose : *poses) {
      x.push_back(pose.R().row(row));
    }
    const auto edge_of = [&graph](size_t i) {
      const GraphEdge& edge = graph.edges[i];
      return LinearEdge{RotationWeight(edge), edge.T_from_to.R().transpose(), Vector3d::Zero()};
    };
    if (!SolveLinear(indices, edge_of, &x)) {
      return false;
    }
    for (size_t vertex = 0; vertex < x.size(); ++vertex) {
      rotations[vertex].row(row) = x[vertex];
    }
  }
  for (size_t vertex = 0; vertex < rotations.size(); ++vertex) {
    if (indices.VariableOf(static_cast<int>(vertex)) != GraphIndices::kStays) {
      (*poses)[vertex].q = Eigen::Quaterniond(NearestRotation(rotations[vertex])).normalized();
    }
  }
  return true;
}

bool AveragePositions(const Graph& graph, const GraphIndices& indices, std::vector<Rigid3>* poses) {
  std::vector<Vector3d> x;
  for (const Rigid3& pose : *poses) {
    x.push_back(pose.t);
  }
  const auto edge_of = [&](size_t i) {
    const GraphEdge& edge = graph.edges[i];
    return LinearEdge{PositionWeight(edge), Matrix3d::Identity(),
                      (*poses)[indices.ends()[i].from].q * edge.T_from_to.t};
  };
  if (!SolveLinear(indices, edge_of, &x)) {
    return false;
  }
  for (size_t vertex = 0; vertex < x.size(); ++vertex) {
    (*poses)[vertex].t = x[vertex];
  }
  return true;
}

}  // namespace

std::vector<Rigid3> AveragePoses(const Graph& graph, const GraphIndices& indices,
                                 std::vector<Rigid3> poses) {
  const bool solved =
      AverageRotations(graph, indices, &poses) && AveragePositions(graph, indices, &poses);
  return solved ? poses : std::vector<Rigid3>();
}

}  // namespace pangea

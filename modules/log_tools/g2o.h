#pragma once

// A pose graph as a g2o text file, readable by g2o, GTSAM, SE-Sync and most others:
// VERTEX_SE3:QUAT, EDGE_SE3:QUAT and FIX lines (g2o, "File format SLAM 3D").
//
// g2o's error of an edge i -> j with measurement Z is e = (t, q_xyz) of Z^-1 T_i^-1 T_j: in the
// measurement's own frame, and half an angle. Ours is xi in the left frame (docs/conventions.md).
// Covariances are converted, so that the graph has the same cost in both.

#include <map>
#include <string>
#include <vector>

#include "core/rigid3.h"

namespace pangea {

struct GraphEdge {
  int from = 0, to = 0;
  Rigid3 T_from_to;
  Matrix6d covariance = Matrix6d::Identity();  // of T_from_to
};

struct Graph {
  std::map<int, Rigid3> vertices;  // T_map_body by number
  std::vector<int> fixed;
  std::vector<GraphEdge> edges;
};

// Sum of the edges' xi^T covariance^-1 xi. Throws std::runtime_error that names an edge whose term
// is negative or not a number.
double Cost(const Graph& graph);

std::string ToG2o(const Graph& graph);
// Throws std::runtime_error with a one-line message with file, line, field and error: an invalid
// number, a coordinate of a pose beyond `max_position_m`, a repeated vertex or edge, an end of an
// edge that is not a vertex, or an information matrix that is not positive definite. Two different
// edges between the same vertices are two measurements.
Graph ReadG2o(const std::string& path, double max_position_m = 1e12);

}  // namespace pangea

#pragma once

// A pose graph as a g2o text file, readable by g2o, GTSAM, SE-Sync and most others:
// VERTEX_SE3:QUAT, EDGE_SE3:QUAT and FIX lines (g2o, "File format SLAM 3D").
//
// Also read: PARAMS_SE3OFFSET, T_body_sensor of a sensor, which g2o writes into every file, and
// EDGE_SE3_OFFSET, which measures T_sensor_from_sensor_to between two of them. It becomes an edge
// between the bodies; with a lever arm at its second end, its cost is g2o's to first order. The
// other users of an offset measure a pose by itself or a landmark, and are refused.
//
// g2o's error of an edge i -> j with measurement Z is (t, q_xyz) of Z^-1 T_i^-1 T_j: in the
// measurement's own frame, and half an angle. Ours (graph.h) is in the left frame. Covariances are
// converted, so that the graph has the same cost in both.

#include <string>

#include "g2o/graph.h"

namespace pangea {

std::string ToG2o(const Graph& graph);
// Throws std::runtime_error with a one-line message with file, line, field and error: an invalid
// number, a coordinate of a pose beyond `max_position_m`, a repeated vertex or edge, an end of an
// edge that is not a vertex, or an information matrix that is not positive definite. Two different
// edges between the same vertices are two measurements.
Graph ReadG2o(const std::string& path, double max_position_m = 1e12);

}  // namespace pangea

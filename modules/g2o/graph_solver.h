#pragma once

// Least squares of a graph of 6-DoF poses: Levenberg-Marquardt on the sparse normal equations, one
// thread.
//
// It starts at the graph's own vertices, or where rotation averaging puts them (chordal relaxation:
// Carlone et al., ICRA 2015, section III), if these have a lower cost: many published graphs hold
// plain odometry, from which a descent ends in another minimum, or nowhere.
//
// Fixed vertices stay. In each connected part without one, the vertex with the lowest number stays.

#include "g2o/graph.h"

namespace pangea {

struct GraphSolution {
  double cost_at_start = 0;  // of the graph as it was given
  double cost = 0;
  int iterations = 0;
  bool averaged = false;   // the descent began where rotation averaging put the vertices
  bool converged = false;  // else it ended after kMaxGraphIterations
};

inline constexpr int kMaxGraphIterations = 200;

// Moves the vertices. Throws as Cost does.
GraphSolution SolveGraph(Graph* graph);

}  // namespace pangea

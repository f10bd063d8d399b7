#pragma once

// A graph's vertices and edges by index: what its equations need.

#include <vector>

#include "g2o/graph.h"

namespace pangea {

class GraphIndices {
 public:
  explicit GraphIndices(const Graph& graph);

  static constexpr int kStays = -1;

  struct Ends {
    int from = 0, to = 0;  // indices of the vertices, in the order of their numbers
  };
  size_t num_vertices() const { return variable_.size(); }
  int num_variables() const { return num_variables_; }
  const std::vector<Ends>& ends() const { return ends_; }  // parallel to Graph::edges
  // Of a vertex, its variable in the equations; kStays if it has none.
  int VariableOf(int vertex) const { return variable_[vertex]; }
  // Per edge, the variables of its ends, ascending.
  const std::vector<std::vector<int>>& cliques() const { return cliques_; }

 private:
  void FindEnds(const Graph& graph);
  std::vector<bool> Stays(const Graph& graph) const;

  std::vector<Ends> ends_;
  std::vector<int> variable_;
  std::vector<std::vector<int>> cliques_;
  int num_variables_ = 0;
};

}  // namespace pangea

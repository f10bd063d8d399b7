#include "g2o/graph_indices.h"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

namespace pangea {

GraphIndices::GraphIndices(const Graph& graph) {
  FindEnds(graph);
  for (const bool stays : Stays(graph)) {
    variable_.push_back(stays ? kStays : num_variables_++);
  }
  for (const auto& [from, to] : ends_) {
    const auto [first, second] = std::minmax(variable_[from], variable_[to]);
    cliques_.push_back(first != kStays    ? std::vector<int>{first, second}
                       : second != kStays ? std::vector<int>{second}
                                          : std::vector<int>{});
  }
}

void GraphIndices::FindEnds(const Graph& graph) {
  std::map<int64_t, int> index;
  for (const auto& [number, pose] : graph.vertices) {
    index.emplace(number, static_cast<int>(index.size()));
  }
  for (const GraphEdge& edge : graph.edges) {
    ends_.push_back({index.at(edge.from), index.at(edge.to)});
  }
}

// Each connected part is a tree of parents whose root is its first vertex, or a fixed one.
std::vector<bool> GraphIndices::Stays(const Graph& graph) const {
  std::vector<int> parent(graph.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&parent](int vertex) {
    while (parent[vertex] != vertex) {
      vertex = parent[vertex] = parent[parent[vertex]];
    }
    return vertex;
  };
  for (const auto& [from, to] : ends_) {
    const auto [first, second] = std::minmax({root(from), root(to)});
    parent[second] = first;
  }
  std::vector<bool> stays(parent.size(), false), held(parent.size(), false);
  for (const int64_t number : graph.fixed) {
    const auto vertex = std::distance(graph.vertices.begin(), graph.vertices.find(number));
    stays[vertex] = true;
    held[root(static_cast<int>(vertex))] = true;
  }
  for (size_t vertex = 0; vertex < parent.size(); ++vertex) {
    if (parent[vertex] == static_cast<int>(vertex) && !held[vertex]) {
      stays[vertex] = true;
    }
  }
  return stays;
}

}  // namespace pangea

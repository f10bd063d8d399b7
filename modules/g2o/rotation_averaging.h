#pragma once

// Poses of a graph from its measurements alone: first all rotations, then all positions, each by
// one linear least-squares problem (chordal relaxation: Martinec and Pajdla, CVPR 2007; Carlone et
// al., ICRA 2015, section III-B).

#include <vector>

#include "g2o/graph.h"
#include "g2o/graph_indices.h"

namespace pangea {

// `poses`: of the vertices in the order of their numbers; those without a variable stay. Empty if
// the equations cannot be solved.
std::vector<Rigid3> AveragePoses(const Graph& graph, const GraphIndices& indices,
                                 std::vector<Rigid3> poses);

}  // namespace pangea

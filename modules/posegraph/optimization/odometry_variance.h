#pragma once

// How far a group's odometry drifts, of what its covariances say: one factor for all of them, the
// one that brings the median innovation of its loops to that of chi-squared (variance component
// estimation, robustly; docs/maths.md, section 5). Never below one.

#include <vector>

#include "posegraph/graph/graph_maps.h"
#include "posegraph/grouping/map_pairs.h"
#include "posegraph/loop.h"
#include "posegraph/pair_evidence.h"

namespace pangea {

// Whether a loop within a map agrees with its odometry.
bool FitsOdometry(const Loop& loop, const OdometryChain& chain);

// What loops within maps that fit the odometry, and merges, say of it; evenly some, if many.
std::vector<PairEvidence::Innovation> Innovations(const std::vector<const Loop*>& loops,
                                                  const std::vector<const MapPair*>& pairs,
                                                  const GraphMaps& maps);

// Of covariances; 1 without innovations.
double OdometryVariance(const std::vector<PairEvidence::Innovation>& innovations);

}  // namespace pangea

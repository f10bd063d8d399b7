#pragma once

// The factor by which a group's odometry covariances are too small: one factor for the whole group.
// It brings the median squared Mahalanobis distance of the innovations to 4, the mean of
// chi-squared with four degrees of freedom (robust variance component estimation; docs/maths.md,
// section 5). Never below one.

#include <vector>

#include "posegraph/graph/graph_maps.h"
#include "posegraph/grouping/map_pairs.h"
#include "posegraph/loop.h"
#include "posegraph/pair_evidence.h"

namespace pangea {

// Whether a loop within a map agrees with its odometry.
bool FitsOdometry(const Loop& loop, const OdometryChain& chain);

// Innovations of the loops within maps that fit the odometry, and of the merged pairs; an evenly
// spaced sample if there are many.
std::vector<PairEvidence::Innovation> Innovations(const std::vector<const Loop*>& loops,
                                                  const std::vector<const MapPair*>& pairs,
                                                  const GraphMaps& maps);

// The factor on the covariances; 1 if there are no innovations.
double OdometryVariance(const std::vector<PairEvidence::Innovation>& innovations);

}  // namespace pangea

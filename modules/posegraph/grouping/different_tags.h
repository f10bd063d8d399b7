#pragma once

// Whether a merge of two maps would put different AprilTags at one place. Halls that look alike are
// told apart by their tags.

#include "posegraph/graph/graph_maps.h"
#include "posegraph/pair_evidence.h"

namespace pangea {

// False without a decision to merge, and if maps share a tag that supports it. Only tags near an
// agreeing constraint count, so that the odometry's drift does not matter.
bool HasDifferentTags(const PairEvidence& evidence, const GraphMap& a, const GraphMap& b);

}  // namespace pangea

#pragma once

// Where a group's maps lie to each other before they are solved: one after the other, along the
// merges with the most agreeing viewpoints.

#include <map>
#include <set>

#include "posegraph/graph/graph_maps.h"
#include "posegraph/grouping/graph_group.h"
#include "posegraph/grouping/map_pairs.h"

namespace pangea {

// From the beginning: every map as its odometry has it, the oldest one's odom is the map frame.
void PlaceMaps(const GraphGroup& group, const MapPairs& pairs, GraphMaps* maps);

// The group's maps that were solved together, by the oldest map of the group they were solved in.
using GroupParts = std::map<int, std::set<int>>;
GroupParts PartsOf(const GraphGroup& group, const GraphMaps& maps);

// Beside a solution: these maps stay, and any part that was solved by itself moves as one.
void PlaceParts(const GraphGroup& group, const std::set<int>& fixed, const GroupParts& parts,
                const MapPairs& pairs, GraphMaps* maps);

}  // namespace pangea

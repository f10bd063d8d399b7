#pragma once

// Initial placement of a group's maps relative to each other: the maps are placed one after
// another, each time along the merge with the most agreeing viewpoints.

#include <map>
#include <set>

#include "posegraph/graph/graph_maps.h"
#include "posegraph/grouping/graph_group.h"
#include "posegraph/grouping/map_pairs.h"

namespace pangea {

// Places all maps anew: nodes by odometry alone; the odom frame of the oldest map is the map frame.
void PlaceMaps(const GraphGroup& group, const MapPairs& pairs, GraphMaps* maps);

// Sets of maps that were solved together, keyed by the oldest map of the group of that solve.
using GroupParts = std::map<int, std::set<int>>;
GroupParts PartsOf(const GraphGroup& group, const GraphMaps& maps);

// Keeps the maps in `fixed`, and moves every other part as one rigid body.
void PlaceParts(const GraphGroup& group, const std::set<int>& fixed, const GroupParts& parts,
                const MapPairs& pairs, GraphMaps* maps);

}  // namespace pangea

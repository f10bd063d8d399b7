#pragma once

// Estimates how well the relative pose of two keyframes is known already, and decides whether
// another constraint is worth its verification: measurement selection by information gain (Ila et
// al., "Information-based compact pose SLAM", TRO 2010).
//
// Only constraints that precede the candidate in candidate_order.h count, so that the decision does
// not depend on which others have arrived.
//
// Nearby constraints are connected to the two keyframes by a few metres of odometry. Each gives the
// relative position with the variance sigma^2 + (drift * path)^2; their information is added as if
// they were independent, although they share odometry. So is that through each third map: from the
// query to its map's last match there, and from there to the candidate's match. The variances
// before and after a new constraint with the median sigma give the bits that it would add to each
// coordinate. Where third maps help, both contain a tolerance: what no user would notice does not
// count. If this gain is small, the candidate is redundant. The first constraints between two maps
// are never redundant: the decision to merge the maps depends on them. The first nearby constraints
// within a map are not redundant either: a single wrong one would displace the map, and only others
// can reveal it.

#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/byte_record.h"
#include "core/keyframe_store.h"
#include "core/server_messages.h"

namespace pangea {

struct KnownConstraintOptions {
  double min_gain_bits = 1;   // one bit halves the sigma of each coordinate
  int min_nearby = 10;        // chosen, not measured
  int min_between_maps = 10;  // chosen, not measured; a fusion takes 2 to 4 viewpoints

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("min_gain_bits", &min_gain_bits, {0, 100}, "bit",
                "that another constraint must bring to each coordinate; 1 halves its sigma; "
                "0: all are verified");
    archive.Add("min_nearby", &min_nearby, {0, 1000000}, "",
                "constraints of one map within reach before another is redundant");
    archive.Add("min_between_maps", &min_between_maps, {0, 1000000}, "",
                "constraints between two maps before any is redundant");
  }
};

class KnownConstraints {
 public:
  // Constraints further away in seq, at either end, are not nearby.
  static constexpr int kMaxSeqDistance = 30;

  explicit KnownConstraints(const KnownConstraintOptions& options) : options_(options) {}

  // Adds an accepted constraint; the caller must not repeat one.
  void Add(const Constraint& constraint);
  void Save(ByteWriter* writer) const;
  void Restore(ByteReader* reader);
  struct Nearby {
    int count = 0;
    // Information that a new constraint would add to each coordinate; infinite if count is 0.
    double gain_bits = 0;
  };
  // `store`: has the odometry of the maps.
  Nearby NearbyOf(const KeyframeId& query, const KeyframeId& match,
                  const KeyframeStore& store) const;
  bool IsRedundant(const KeyframeId& query, const KeyframeId& match,
                   const KeyframeStore& store) const;

 private:
  struct Known {
    int32_t seq_a = 0, seq_b = 0;
    bool query_is_a = false;
    double sigma_m = 0;  // of the position, in the worst direction
  };
  // What constraints near both keyframes tell of their relative position.
  struct Knowledge {
    double information = 0;  // of each coordinate, 1/m^2
    std::vector<double> sigmas;
  };
  Knowledge KnowledgeOf(const KeyframeId& query, const KeyframeId& match,
                        const KeyframeStore& store) const;
  // The keyframe of the third map that the latest query of this map before this one matched, if it
  // is near. So all constraints that KnowledgeOf uses on the way there precede the candidate.
  std::optional<KeyframeId> LastMatchIn(const MapId& third, const KeyframeId& query) const;
  std::vector<KeyframeId> WaysThroughThirdMaps(const KeyframeId& query,
                                               const KeyframeId& match) const;
  void NoteNeighbours(const MapId& a, const MapId& b);
  using BySeq = std::multimap<int32_t, Known>;  // key: seq_a
  // The accepted constraints between the candidate's maps; null if there are none.
  const BySeq* Between(const KeyframeId& query, const KeyframeId& match) const;
  // Whether the constraint, between the candidate's maps, precedes it (RestsOn).
  static bool Precedes(const Known& known, const KeyframeId& query, const KeyframeId& match);
  bool ManyBetweenMaps(const KeyframeId& query, const KeyframeId& match) const;

  KnownConstraintOptions options_;
  std::map<std::pair<MapId, MapId>, BySeq> by_maps_;
  std::map<MapId, std::set<MapId>> neighbours_;  // of each map, those with constraints to it
};

}  // namespace pangea

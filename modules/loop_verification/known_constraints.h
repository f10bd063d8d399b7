#pragma once

// What the map knows already of two keyframes' relative pose, and whether another constraint would
// be worth its verification: measurement selection by information gain (Ila et al., "Information-
// based compact pose SLAM", TRO 2010).
//
// Only constraints that a candidate rests on count (core/candidates/candidate_order.h), so that the
// answer does not depend on which others are there already.
//
// Constraints verified nearby reach the two keyframes over a few metres of odometry. Each gives
// the position to sigma^2 + (drift * path)^2; their information adds up as if they were
// independent, though they share odometry. A constraint of their median sigma would add
// 0.5 * log2(1 + I_new / I_known) bits to each coordinate. Where that is little it is redundant.
// The first constraints between two maps are never redundant: whether the maps are one rests on
// them. Nor are, within one map, the first within reach: a single one would move the map by
// whatever it is wrong, and only others show it.

#include <map>
#include <utility>
#include <vector>

#include "core/byte_record.h"
#include "core/server_messages.h"
#include "core/submap_store.h"

namespace pangea {

struct KnownConstraintOptions {
  double min_gain_bits = 1;   // one bit: the sigma of each coordinate halved
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
  // Of keyframes that are further away in seq nothing is asked.
  static constexpr int kMaxSeqDistance = 30;

  explicit KnownConstraints(const KnownConstraintOptions& options) : options_(options) {}

  // An accepted constraint. A repeat must not come.
  void Add(const Constraint& constraint);
  void Save(ByteWriter* writer) const;
  void Restore(ByteReader* reader);
  struct Nearby {
    int count = 0;
    // What a constraint between the two would add to each coordinate; infinite where nothing is
    // known.
    double gain_bits = 0;
  };
  // Odometry is `store`'s.
  Nearby NearbyOf(const KeyframeId& query, const KeyframeId& match, const SubmapStore& store) const;
  bool IsRedundant(const KeyframeId& query, const KeyframeId& match,
                   const SubmapStore& store) const;

 private:
  struct Known {
    int32_t seq_a = 0, seq_b = 0;
    bool query_is_a = false;
    double sigma_m = 0;  // of the position, its worst direction
  };
  // The accepted constraints between the candidate's maps that it rests on.
  std::vector<Known> KnownTo(const KeyframeId& query, const KeyframeId& match) const;

  KnownConstraintOptions options_;
  std::map<std::pair<MapId, MapId>, std::multimap<int32_t, Known>> by_maps_;  // by seq_a
};

}  // namespace pangea

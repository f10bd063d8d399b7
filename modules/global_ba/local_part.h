#pragma once

// The part of a group that an adjustment moves when the rest has been adjusted before (the local
// bundle adjustment of Mur-Artal et al., TRO 2015, section VI.D, over what is new since then): new
// keyframes and the ends of new matched pairs, then those that share landmarks with them, then with
// these, up to a bound. Held are those that share landmarks with what moves.

#include <set>
#include <vector>

#include "core/submap_store.h"
#include "global_ba/adjusted_group.h"
#include "global_ba/matched_pairs.h"

namespace pangea {

struct LocalOptions {
  int keyframes = 500;        // of a group of which a part is adjusted
  int max_neighbours = 100;   // that move beside what is new
  double whole_growth = 1.5;  // of a group, since it was adjusted as a whole
  double max_shift_m = 0.05;  // of what was adjusted before

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("keyframes", &keyframes, {0, 100000000}, "",
                "of a group; one with more is adjusted near what is new, a smaller one as a whole");
    archive.Add("max_neighbours", &max_neighbours, {0, 1000000}, "keyframes",
                "that move beside those that are new");
    archive.Add("whole_growth", &whole_growth, {1, 1000}, "",
                "of a group since it was adjusted as a whole, at which it is again");
    archive.Add("max_shift_m", &max_shift_m, {0, 1000}, "m",
                "of a keyframe that was adjusted before; beyond it the whole group is");
  }
};

struct LocalPart {
  std::set<KeyframeId> moving;
  std::set<KeyframeId> held;  // and those between that the adjustment before left out
};

LocalPart ChooseLocalPart(const MapPoses& state, const AdjustedGroup& adjusted,
                          const MatchedPairs& pairs, const std::vector<KeyframePair>& new_pairs,
                          int max_neighbours, SubmapStore* store);

}  // namespace pangea

#pragma once

// The part of a group that a local adjustment moves, if the group has been adjusted before (like
// the local bundle adjustment of Mur-Artal et al., TRO 2015, section VI.D). Moving are: new
// keyframes and the ends of new matched pairs; keyframes that share landmarks with these; then
// those that share landmarks with the latter, and so on up to a bound. Fixed are other keyframes
// that share landmarks with moving ones.

#include <set>
#include <vector>

#include "core/keyframe_store.h"
#include "global_ba/adjusted_group.h"
#include "global_ba/matched_pairs.h"

namespace pangea {

struct LocalOptions {
  int keyframes = 150;        // a group with more keyframes is adjusted in part
  int max_neighbours = 100;   // moving keyframes in addition to new ones
  double whole_growth = 2;    // relative size, since the last whole adjustment
  double max_shift_m = 0.05;  // of keyframes adjusted before

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("keyframes", &keyframes, {0, 100000000}, "",
                "of a group; one with more is adjusted near what is new, a smaller one as a whole");
    archive.Add("max_neighbours", &max_neighbours, {0, 1000000}, "keyframes",
                "that move beside those that are new");
    archive.Add("whole_growth", &whole_growth, {1, 1000}, "",
                "of a group since it was adjusted as a whole, at which it is again, if small");
    archive.Add("max_shift_m", &max_shift_m, {0, 1000}, "m",
                "of a keyframe that was adjusted before; beyond it the whole group is");
  }
};

struct LocalPart {
  std::set<KeyframeId> moving;
  std::set<KeyframeId> fixed;  // may include keyframes that the last adjustment left out
};

LocalPart ChooseLocalPart(const MapPoses& state, const AdjustedGroup& adjusted,
                          const MatchedPairs& pairs, const std::vector<KeyframePair>& new_pairs,
                          int max_neighbours, KeyframeStore* store);

}  // namespace pangea

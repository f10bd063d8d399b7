#pragma once

// Options of the pose graph (posegraph.h).

#include "posegraph/pair_evidence.h"

namespace pangea {

struct PoseGraphOptions {
  enum class Scope {
    kAll,    // every keyframe of the group is free, except one
    kPaper,  // free: the oldest map from its first loop on, the others from the start
  };
  Scope scope = Scope::kAll;
  MergeOptions merge;
  // In a group with more keyframes than this, an ordinary solve moves only the maps with new loops
  // and the maps that share loops in force with them; the others stay fixed. All maps are solved
  // again once the loops have grown by a fifth (or by a tenth, when no more messages arrive).
  int local_keyframes = 1000;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.AddChoice("scope", &scope, {{"all", Scope::kAll}, {"paper", Scope::kPaper}},
                      "keyframes that are free: all but one, or as in the paper");
    archive.Add("local_keyframes", &local_keyframes, {1, 100000000}, "",
                "of a group of which a solve moves only what is near new loops");
    archive.Section("merge", &merge, "when maps become one group");
  }
};

}  // namespace pangea

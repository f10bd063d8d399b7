#pragma once

// What the pose graph lets one choose (posegraph.h).

#include "posegraph/pair_evidence.h"

namespace pangea {

struct PoseGraphOptions {
  enum class Scope {
    kAll,    // every keyframe of the group but one
    kPaper,  // the main map from its first overlap on; the other maps from their first keyframe
  };
  Scope scope = Scope::kAll;
  MergeOptions merge;
  // Of a group with more keyframes than this a solve moves the maps that have new loops, and those
  // that share loops with them; all others stay, until the group's loops have grown by a tenth.
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

#pragma once

// What the pose graph lets one choose (posegraph.h).

#include "posegraph/pair_evidence.h"
#include "posegraph/solver/group_solver.h"

namespace pangea {

struct PoseGraphOptions {
  enum class Scope {
    kAll,    // every keyframe of the group but one
    kPaper,  // the main map from its first overlap on; the other maps from their first keyframe
  };
  Scope scope = Scope::kAll;
  MergeOptions merge;
  GroupSolverOptions solver;
  // A group solves after each loop; a larger one waits for one more loop per so many keyframes,
  // or for so many new keyframes since the first waiting loop.
  int keyframes_per_waiting_loop = 300;
  int max_keyframes_waiting = 10;
  // Of a group with more keyframes than this a solve moves the maps that have new loops, and those
  // that share loops with them; all others stay, until the group's loops have grown by a tenth.
  int local_keyframes = 1000;
  // A group's state is published again after so many new keyframes, and 2 % of the group.
  int state_every = 10;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.AddChoice("scope", &scope, {{"all", Scope::kAll}, {"paper", Scope::kPaper}},
                      "keyframes that are free: all but one, or as in the paper");
    archive.Add("keyframes_per_waiting_loop", &keyframes_per_waiting_loop, {1, 1000000}, "",
                "of a group: it waits for one more loop before it solves");
    archive.Add("max_keyframes_waiting", &max_keyframes_waiting, {0, 1000000}, "",
                "new keyframes for which loops wait at most");
    archive.Add("local_keyframes", &local_keyframes, {1, 100000000}, "",
                "of a group of which a solve moves only what is near new loops");
    archive.Add("state_every", &state_every, {1, 1000000}, "",
                "new keyframes, and 2 % of the group");
    archive.Section("merge", &merge, "when maps become one group");
    archive.Section("solver", &solver, "graduated non-convexity");
  }
};

}  // namespace pangea

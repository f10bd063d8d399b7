#pragma once

// A group: maps that are one, when it is solved again, and when it is published again.

#include <cstdint>
#include <set>
#include <vector>

#include "core/byte_record.h"
#include "posegraph/loop.h"
#include "posegraph/posegraph_options.h"

namespace pangea {

// Decides by counts alone: of loops, keyframes and maps since the last solve.
struct SolveSchedule {
  static constexpr int kMaxKeyframesWaiting = 10;  // since the first waiting loop

  bool regrouped = true;      // the group has other maps than at the last solve
  bool stale = false;         // loops since the last solve from the beginning
  int waiting_loops = 0;      // since the last solve
  int keyframes_waiting = 0;  // since the first of them
  int64_t known_loops = 0;    // the group's loops that the last graduated solve saw
  int64_t whole_loops = 0;    // that the last solve from the beginning saw
  std::set<int> changed;      // maps with loops since the last solve

  void AddLoop(const Loop& loop);
  void AddKeyframe() { keyframes_waiting += waiting_loops > 0 ? 1 : 0; }
  void Solved();

  // Maps came or went, and no solve knows them together.
  bool NewMapsWait() const { return regrouped && stale; }
  bool LoopsWaitLongEnough(size_t num_keyframes) const;
  // Whether the group is solved from the beginning once nothing more comes.
  bool WholeIsDue(size_t num_keyframes, int64_t num_loops, const PoseGraphOptions& options) const;
};

struct PublicationSchedule {
  static constexpr int kMinKeyframes = 10;  // new ones, and 2 % of the group

  bool unpublished = true;  // something is new
  bool now = false;         // it is to be published with the next update
  int keyframes = 0;        // since it was published

  void AddKeyframe(size_t num_keyframes);
  void Request() { unpublished = now = true; }
  void Published() {
    unpublished = now = false;
    keyframes = 0;
  }
};

struct GraphGroup {
  std::vector<int> maps;  // numbers, ascending: the first is the oldest
  SolveSchedule solve;
  PublicationSchedule publication;
  double odometry_variance = 1;  // its factor (optimization/odometry_variance.h)

  int oldest() const { return maps.front(); }

  void Save(ByteWriter* writer) const;
  void Restore(ByteReader* reader);
};

}  // namespace pangea

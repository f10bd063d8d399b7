#pragma once

// A group of merged maps, with the schedules that decide when to solve it and publish it again.

#include <cstdint>
#include <set>
#include <vector>

#include "core/byte_record.h"
#include "posegraph/loop.h"
#include "posegraph/posegraph_options.h"

namespace pangea {

// Decides only by counts: new loops, keyframes and maps since the last solve.
struct SolveSchedule {
  static constexpr int kMaxKeyframesWaiting = 10;  // since the first waiting loop

  bool regrouped = true;      // the set of maps differs from that of the last solve
  bool stale = false;         // a loop came since the last solve from the beginning
  int waiting_loops = 0;      // loops since the last solve
  int keyframes_waiting = 0;  // keyframes since the first waiting loop
  int64_t known_loops = 0;    // the group's loops at the last graduated solve
  int64_t whole_loops = 0;    // the group's loops at the last solve from the beginning
  std::set<int> changed;      // maps that got loops since the last solve

  void AddLoop(const Loop& loop);
  void AddKeyframe() { keyframes_waiting += waiting_loops > 0 ? 1 : 0; }
  void Solved();

  // The group's maps changed, and no solve has treated these maps together yet.
  bool NewMapsWait() const { return regrouped && stale; }
  bool LoopsWaitLongEnough(size_t num_keyframes) const;
  // Whether the group is to be solved from the beginning when no more messages arrive.
  bool WholeIsDue(size_t num_keyframes, int64_t num_loops, const PoseGraphOptions& options) const;
};

struct PublicationSchedule {
  static constexpr int kMinKeyframes = 10;  // new ones, and 2 % of the group

  bool unpublished = true;  // something has changed since it was published
  bool now = false;         // the next update publishes it
  int keyframes = 0;        // added since it was published

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
  double odometry_variance = 1;  // factor on odometry covariances (odometry_variance.h)

  int oldest() const { return maps.front(); }

  void Save(ByteWriter* writer) const;
  void Restore(ByteReader* reader);
};

}  // namespace pangea

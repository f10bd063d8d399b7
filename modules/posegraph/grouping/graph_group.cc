#include "posegraph/grouping/graph_group.h"

#include <algorithm>

namespace pangea {

void SolveSchedule::AddLoop(const Loop& loop) {
  ++waiting_loops;
  changed.insert({loop.from.map, loop.to.map});
  stale = true;
}

void SolveSchedule::Solved() {
  regrouped = false;
  waiting_loops = keyframes_waiting = 0;
  changed.clear();
}

bool SolveSchedule::LoopsWaitLongEnough(size_t num_keyframes) const {
  // A small group is solved after each loop. A larger group takes longer, so it waits for one more
  // loop per kKeyframesPerLoop keyframes.
  constexpr int kKeyframesPerLoop = 300;
  const int enough = 1 + static_cast<int>(num_keyframes) / kKeyframesPerLoop;
  return waiting_loops >= enough ||
         (waiting_loops > 0 && keyframes_waiting >= kMaxKeyframesWaiting);
}

bool SolveSchedule::WholeIsDue(size_t num_keyframes, int64_t num_loops,
                               const PoseGraphOptions& options) const {
  constexpr int64_t kShare = 10;
  if (!stale || num_keyframes <= static_cast<size_t>(options.local_keyframes)) {
    return stale;
  }
  return kShare * (num_loops - whole_loops) >= num_loops;
}

void PublicationSchedule::AddKeyframe(size_t num_keyframes) {
  constexpr size_t kShare = 50;
  unpublished = true;
  ++keyframes;
  if (keyframes >= std::max(kMinKeyframes, static_cast<int>(num_keyframes / kShare))) {
    now = true;
  }
}

void GraphGroup::Save(ByteWriter* writer) const {
  writer->Put(maps);
  writer->Put(solve.regrouped);
  writer->Put(solve.stale);
  writer->Put(solve.waiting_loops);
  writer->Put(solve.keyframes_waiting);
  writer->Put(solve.known_loops);
  writer->Put(solve.whole_loops);
  writer->Put(std::vector<int>(solve.changed.begin(), solve.changed.end()));
  writer->Put(odometry_variance);
  writer->Put(publication.unpublished);
  writer->Put(publication.now);
  writer->Put(publication.keyframes);
}

void GraphGroup::Restore(ByteReader* reader) {
  reader->Get(&maps);
  reader->Get(&solve.regrouped);
  reader->Get(&solve.stale);
  reader->Get(&solve.waiting_loops);
  reader->Get(&solve.keyframes_waiting);
  reader->Get(&solve.known_loops);
  reader->Get(&solve.whole_loops);
  std::vector<int> changed;
  reader->Get(&changed);
  solve.changed = {changed.begin(), changed.end()};
  reader->Get(&odometry_variance);
  reader->Get(&publication.unpublished);
  reader->Get(&publication.now);
  reader->Get(&publication.keyframes);
}

}  // namespace pangea

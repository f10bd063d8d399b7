#include "posegraph/posegraph.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace pangea {

PoseGraph::PoseGraph(const PoseGraphOptions& options, std::optional<int64_t> start_utime)
    : options_(options),
      start_utime_(start_utime),
      pairs_(options.merge),
      publisher_(start_utime.value_or(1)) {}

int PoseGraph::NumberOf(const MapId& map) {
  const int number = maps_.Add(map);
  if (static_cast<size_t>(number) == groups_.num_maps()) {
    groups_.AddMap();
  }
  return number;
}

void PoseGraph::AddKeyframe(const Keyframe& keyframe) {
  const int number = NumberOf(keyframe.id.map);
  if (!maps_[number].Add(keyframe)) {
    return;
  }
  PassEarlierRevisions(maps_[number]);
  GraphGroup& group = groups_.Of(number);
  group.solve.AddKeyframe();
  group.publication.AddKeyframe(maps_.NumKeyframes(group.maps));
  constraints_.KeyframeCame(
      keyframe.id, [this](const Constraint& constraint) { return UseConstraint(constraint); });
}

void PoseGraph::AddConstraint(const Constraint& constraint) {
  if (!constraint.accepted && constraint.reason == kDifferentTags) {
    NoteDifferentTags(constraint);
  }
  constraints_.Add(constraint, [this](const Constraint& one) { return UseConstraint(one); });
}

void PoseGraph::NoteDifferentTags(const Constraint& constraint) {
  const auto from = maps_.Number(constraint.from.map), to = maps_.Number(constraint.to.map);
  if (from && to && *from != *to && pairs_.NoteDifferentTags(*from, *to, constraint.Id(), maps_)) {
    groups_.Regroup(pairs_);
  }
}

bool PoseGraph::UseConstraint(const Constraint& constraint) {
  const auto from = maps_.Find(constraint.from);
  const auto to = maps_.Find(constraint.to);
  if (!from || !to) {
    return false;
  }
  Loop made = MakeLoop(constraint, *from, *to, maps_);
  made.sufficient = made.sufficient && !(made.tag && MovedTags().contains(*made.tag));
  const Loop& loop = loops_.Add(made);
  if (!loop.intra() && pairs_.Add(loop, maps_)) {
    groups_.Regroup(pairs_);
    restored_ &= IsUsed(loop);  // a separation shows that the restored solution is wrong
  }
  if (IsUsed(loop)) {
    groups_.Of(from->map).solve.AddLoop(loop);
  }
  return true;
}

void PoseGraph::AddRefinement(const MapState& refined) {
  if (publisher_.AddRefinement(refined, maps_)) {
    for (const MapId& map : refined.maps) {
      Republish(map);
    }
  }
}

void PoseGraph::Republish(const MapId& map) {
  if (const std::optional<int> number = maps_.Number(map)) {
    groups_.Of(*number).publication.Request();
  }
}

bool PoseGraph::WholeIsDue(const GraphGroup& group) const {
  return group.solve.stale &&
         group.solve.WholeIsDue(maps_.NumKeyframes(group.maps),
                                static_cast<int64_t>(loops_.Among(group.maps).size()), options_);
}

bool PoseGraph::SolveIsDue(const GraphGroup& group, bool from_the_beginning) const {
  return group.solve.NewMapsWait() ||
         group.solve.LoopsWaitLongEnough(maps_.NumKeyframes(group.maps)) ||
         (from_the_beginning && (group.solve.waiting_loops > 0 || WholeIsDue(group)));
}

void PoseGraph::SolveOnce(GraphGroup* group, bool from_the_beginning) {
  const bool whole = from_the_beginning && WholeIsDue(*group);
  if (!whole && group->solve.regrouped && Optimiser().JoinsALargePart(*group)) {
    Optimiser().SolveJoined(group);
  } else {
    Optimiser().Solve(group, whole);
  }
  ++num_solves_;
}

void PoseGraph::SolveDue(bool from_the_beginning) {
  const auto due = [&](const auto& entry) { return SolveIsDue(entry.second, from_the_beginning); };
  std::map<int, GraphGroup>& groups = groups_.by_oldest();
  for (auto it = std::ranges::find_if(groups, due); it != groups.end();
       it = std::ranges::find_if(groups, due)) {
    SolveOnce(&it->second, from_the_beginning);
    if (UndoMerges(it->second)) {
      groups_.Regroup(pairs_);
    }
  }
}

void PoseGraph::SolveRestored() {
  bool undone = false;
  for (auto& [oldest, group] : groups_.by_oldest()) {
    if (group.solve.NewMapsWait()) {
      if (Optimiser().HasJoined(group)) {
        Optimiser().SolveJoined(&group);
      } else {
        Optimiser().Solve(&group, false);
      }
      ++num_solves_;
      undone |= UndoMerges(group);
    }
  }
  if (undone) {
    groups_.Regroup(pairs_);
  }
}

bool PoseGraph::UndoMerges(const GraphGroup& group) {
  return pairs_.UndoMerges(group.maps, std::as_const(loops_).Among(group.maps));
}

PoseGraphUpdate PoseGraph::Update() {
  if (std::exchange(restored_, false)) {
    SolveRestored();
  }
  SolveDue(false);
  return Publish(false);
}

PoseGraphUpdate PoseGraph::Finish() {
  if (std::ranges::any_of(groups_.by_oldest(),
                          [](const auto& entry) { return entry.second.solve.stale; })) {
    pairs_.RedoMerges();
    groups_.Regroup(pairs_);
  }
  SolveDue(true);
  return Publish(true);
}

// A replay's keyframes name the revisions of the captured run, which are not of its own.
void PoseGraph::PassEarlierRevisions(const GraphMap& map) {
  if (start_utime_) {
    publisher_.PassRevision(map.known_revision);
  }
}

PoseGraphUpdate PoseGraph::Publish(bool all_that_is_new) {
  PoseGraphUpdate update;
  for (auto& [oldest, group] : groups_.by_oldest()) {
    if (group.publication.now || (all_that_is_new && group.publication.unpublished)) {
      publisher_.Publish(&group, maps_, loops_, &update);
    }
  }
  return update;
}

std::vector<MapState> PoseGraph::States() const {
  std::vector<MapState> states;
  for (const auto& [oldest, group] : groups_.by_oldest()) {
    states.push_back(publisher_.StateOf(group, maps_, loops_));
  }
  return states;
}

double PoseGraph::LogScale(const MapId& map) const {
  const std::optional<int> number = maps_.Number(map);
  return number ? maps_[*number].log_scale : 0;
}

std::vector<int64_t> PoseGraph::InForce() const {
  std::vector<int64_t> ids;
  for (const Loop& loop : loops_) {
    if (loop.on && IsUsed(loop)) {
      ids.push_back(loop.id);
    }
  }
  std::ranges::sort(ids);
  return ids;
}

std::set<TagId> PoseGraph::MovedTags() const {
  constexpr int kMinRejected = 2;
  std::map<TagId, int> rejected;
  for (const Loop* loop : loops_.ByTags()) {
    rejected[*loop->tag] += !loop->on && IsUsed(*loop) ? 1 : 0;
  }
  std::set<TagId> moved;
  for (const auto& [tag, count] : rejected) {
    if (count >= kMinRejected) {
      moved.insert(tag);
    }
  }
  return moved;
}

PoseGraph::Counters PoseGraph::counters() const {
  Counters counters;
  counters.maps = static_cast<int64_t>(maps_.size());
  counters.groups = static_cast<int64_t>(groups_.by_oldest().size());
  for (const Loop& loop : loops_) {
    ++(!IsUsed(loop) ? counters.unused : loop.on ? counters.in_force : counters.switched_off);
  }
  counters.solves = num_solves_;
  for (const GraphMap& map : maps_) {
    counters.bridged += map.chain.num_bridged();
    counters.not_metric += map.chain.UnknownScale() > 0 ? 1 : 0;
  }
  counters.waiting = static_cast<int64_t>(constraints_.num_waiting());
  for (const auto& [oldest, group] : groups_.by_oldest()) {
    counters.odometry_scale = std::max(counters.odometry_scale, std::sqrt(group.odometry_variance));
  }
  return counters;
}

void PoseGraph::Save(ByteWriter* writer) {
  SolveDue(false);
  writer->Put(num_solves_);
  maps_.Save(writer);
  loops_.Save(writer);
  pairs_.Save(writer);
  groups_.Save(writer);
  constraints_.Save(writer);
}

bool PoseGraph::Restore(ByteReader* reader) {
  PoseGraph graph(options_, start_utime_);
  if (!graph.Read(reader) || !reader->at_end()) {
    return false;
  }
  graph.restored_ = true;
  for (const GraphMap& map : graph.maps_) {
    graph.PassEarlierRevisions(map);
  }
  *this = std::move(graph);
  return true;
}

bool PoseGraph::Read(ByteReader* reader) {
  reader->Get(&num_solves_);
  if (!maps_.Restore(reader) || !loops_.Restore(reader, maps_) || !pairs_.Restore(reader, maps_) ||
      !groups_.Restore(reader, maps_.size())) {
    return false;
  }
  for (const auto& [oldest, group] : groups_.by_oldest()) {
    for (const int map : group.maps) {
      maps_[map].solved_with = oldest;
    }
  }
  return constraints_.Restore(reader);
}

}  // namespace pangea

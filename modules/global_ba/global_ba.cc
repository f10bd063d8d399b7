#include "global_ba/global_ba.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/byte_record.h"

namespace pangea {
namespace {

std::vector<uint8_t> ToRecord(const std::vector<std::pair<int, int>>& corners) {
  ByteRecordWriter writer;
  writer.Put(static_cast<uint32_t>(corners.size()));
  for (const auto& [query, match] : corners) {
    writer.Put(static_cast<int16_t>(query));
    writer.Put(static_cast<int16_t>(match));
  }
  return writer.Take();
}

std::vector<std::pair<int, int>> CornersFromRecord(const std::vector<uint8_t>& record) {
  ByteRecordReader reader(record);
  std::vector<std::pair<int, int>> corners(reader.GetCount(2 * sizeof(int16_t)));
  for (auto& [query, match] : corners) {
    int16_t corner = 0;
    reader.Get(&corner);
    query = corner;
    reader.Get(&corner);
    match = corner;
  }
  return corners;
}

constexpr size_t kMinKeyframes = 10;  // smallest group that is adjusted
// Largest group that is adjusted as a whole because it has grown. In one hall, where all keyframes
// share landmarks, the time for the whole grows with the third power.
constexpr size_t kMaxGrown = 250;
// A whole adjustment that moved keyframes by more than this (root mean square) is repeated from its
// result: its set of landmarks depends on the initial poses, and so, without the repetition, the
// result would depend on earlier adjustments.
constexpr double kSettled_m = 1e-3;
constexpr int kMaxPasses = 3;

// A group's poses after its adjustment; a keyframe that was left out keeps its pose relative to the
// adjusted one before it.
MapPoses PosesAfter(const AdjustedGroup& adjusted, const MapPoses& before) {
  MapPoses after;
  Rigid3 T_after_before;
  for (const auto& [id, T_map_body] : before) {
    if (const KeyframeState* state = adjusted.Find(id)) {
      T_after_before = state->T_map_body * T_map_body.Inverse();
    }
    after[id] = T_after_before * T_map_body;
  }
  return after;
}

double RmsMove(const MapPoses& before, const MapPoses& after) {
  double sum = 0;
  for (const auto& [id, T_map_body] : before) {
    sum += (after.at(id).t - T_map_body.t).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(before.size()));
}

// Largest displacement, m, of a keyframe that was adjusted before.
double LargestShift(const BaWorld& world, const AdjustedGroup& before, const MapPoses& poses) {
  double largest = 0;
  for (const BaKeyframe& keyframe : world.keyframes) {
    if (before.Find(keyframe.id) != nullptr) {
      const double shift = (keyframe.state.T_map_body.t - poses.at(keyframe.id).t).norm();
      largest = std::max(largest, shift);
    }
  }
  return largest;
}

}  // namespace

GlobalBa::GlobalBa(const GlobalBaOptions& options, std::shared_ptr<RecordStore> records)
    : options_(options), records_(std::move(records)), store_(kStore, records_) {}

void GlobalBa::Save(ByteWriter* writer) const {
  writer->PutCount(matched_.size());
  for (const auto& [pair, corners] : matched_) {
    writer->Put(pair.first);
    writer->Put(pair.second);
    writer->Put(corners.Bytes(records_.get()).value_or(std::vector<uint8_t>{}));
  }
  writer->PutCount(pairs_.all().size());
  for (const KeyframePair& pair : pairs_.all()) {
    writer->Put(pair.first);
    writer->Put(pair.second);
  }
  store_.Save(writer);
}

bool GlobalBa::Restore(ByteReader* reader) {
  std::map<KeyframePair, Record> matched;
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    KeyframePair pair;
    std::vector<uint8_t> corners;
    reader->Get(&pair.first);
    reader->Get(&pair.second);
    reader->Get(&corners);
    matched.emplace_hint(matched.end(), pair, Record(std::move(corners), records_.get()));
  }
  MatchedPairs pairs;
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    KeyframePair pair;
    reader->Get(&pair.first);
    reader->Get(&pair.second);
    pairs.Insert(pair);
  }
  if (!store_.Restore(reader)) {
    return false;
  }
  matched_ = std::move(matched);
  pairs_ = std::move(pairs);
  return true;
}

void GlobalBa::Take(Keyframe keyframe) {
  if (!store_.Contains(keyframe.id)) {
    DropIfAbout(keyframe.id.map);
    store_.Add(std::move(keyframe));
  }
}

void GlobalBa::Take(const PlaceMatch& match) {
  for (const PlaceCandidate& candidate : match.candidates) {
    const KeyframePair pair(match.query, candidate.match);
    if (matched_.size() < kMaxMatched && !matched_.contains(pair)) {
      matched_.emplace(pair, Record(ToRecord(candidate.corner_matches), records_.get()));
    }
  }
}

void GlobalBa::Take(const Constraint& constraint) {
  const KeyframePair pair(constraint.to, constraint.from);
  if (!constraint.accepted && constraint.reason != kRedundant) {
    matched_.erase(pair);
  } else if (pairs_.Insert(pair)) {
    if (constraint.accepted) {
      DropIfAbout(constraint.to.map);
    }
    new_pairs_.insert(pair);
  }
}

void GlobalBa::Take(MapState state) {
  std::ranges::sort(state.maps);
  const StatePointer taken = states_.Take(std::move(state));
  const bool is_newest = states_.Find(taken->group) == taken.get();
  const auto refined = refined_.find(taken->group);
  if (is_newest && refined != refined_.end() && refined->second.basis == BasisOf(*taken) &&
      !refined->second.adjusted.IsShapeOf(PosesOf(*taken))) {
    refined_.erase(refined);
  }
  if (work_ != nullptr && BasisOf(*states_.Find(work_->state->group)) != BasisOf(*work_->state)) {
    DropIfAbout(work_->state->group);
  }
}

void GlobalBa::DropIfAbout(const MapId& map) {
  if (work_ != nullptr && std::ranges::binary_search(work_->state->maps, map)) {
    new_pairs_.insert(work_->new_pairs.begin(), work_->new_pairs.end());
    work_.reset();
    ++counters_.dropped;
  }
}

const MapState* GlobalBa::RefinementOf(const MapId& map) const {
  const MapState* const state = states_.Find(map);
  const auto known = state == nullptr ? refined_.end() : refined_.find(state->group);
  return known == refined_.end() ? nullptr : &known->second.state;
}

GlobalBa::Basis GlobalBa::BasisOf(const MapState& state) {
  return {state.maps, state.keyframes.size(), state.num_constraints, state.num_switched_off};
}

GlobalBa::StatePointer GlobalBa::NextDue() const {
  for (const auto& [map, state] : states_.by_map()) {
    if (map == state->group && state->num_constraints > 0 &&
        state->keyframes.size() >= kMinKeyframes && states_.IsCurrent(*state) && IsDue(*state)) {
      return state;
    }
  }
  return nullptr;
}

bool GlobalBa::IsDue(const MapState& state) const {
  const auto known = refined_.find(state.group);
  return known == refined_.end() ||
         (known->second.state.revision < state.revision &&
          (known->second.whole_is_due || known->second.basis != BasisOf(state)));
}

bool GlobalBa::IsLocal(const MapState& state, const MapPoses& poses) const {
  const auto known = refined_.find(state.group);
  if (known == refined_.end()) {
    return false;
  }
  const auto& [basis, refined, adjusted, whole_keyframes, whole_is_due] = known->second;
  const size_t count = state.keyframes.size();
  const bool has_grown =
      count <= kMaxGrown && static_cast<double>(count) >=
                                options_.local.whole_growth * static_cast<double>(whole_keyframes);
  return count > static_cast<size_t>(options_.local.keyframes) && !whole_is_due && !has_grown &&
         adjusted.IsShapeOf(poses);
}

std::optional<MapState> GlobalBa::Advance() {
  if (work_ == nullptr) {
    if (StatePointer due = NextDue()) {
      Begin(std::move(due));
    }
    return std::nullopt;
  }
  if (work_->problem->Advance() || BeginAgain()) {
    return std::nullopt;
  }
  return Finish();
}

void GlobalBa::Begin(StatePointer state) {
  work_ = std::make_unique<Work>();
  const MapPoses& poses = work_->begin = PosesOf(*state);
  work_->local = IsLocal(*state, poses);
  work_->new_pairs = TakeNewPairs(*state, poses);
  work_->state = std::move(state);
  work_->problem = work_->local ? Local(poses) : Whole(*work_->state, poses);
  ++counters_.begun;
}

bool GlobalBa::BeginAgain() {
  if (work_->local || ++work_->passes == kMaxPasses) {
    return false;
  }
  const MapPoses after =
      PosesAfter(AfterAdjustment(work_->problem->world(), work_->begin, nullptr), work_->begin);
  const bool again = RmsMove(work_->begin, after) > kSettled_m;
  if (again) {
    work_->begin = after;
    work_->problem = Whole(*work_->state, after);
  }
  return again;
}

std::vector<KeyframePair> GlobalBa::TakeNewPairs(const MapState& state, const MapPoses& poses) {
  std::vector<KeyframePair> taken;
  for (const MapId& map : state.maps) {
    for (auto pair = new_pairs_.lower_bound({{map, 0}, {}});
         pair != new_pairs_.end() && pair->first.map == map;) {
      if (poses.contains(pair->first) && poses.contains(pair->second)) {
        taken.push_back(*pair);
        pair = new_pairs_.erase(pair);
      } else {
        ++pair;
      }
    }
  }
  return taken;
}

std::unique_ptr<BaProblem> GlobalBa::Whole(const MapState& state, const MapPoses& poses) {
  std::vector<MatchedPair> pairs;
  for (const MapId& map : state.maps) {
    for (const KeyframePair& pair : pairs_.OfMap(map)) {
      AddPair(pair, &pairs);
    }
  }
  return std::make_unique<BaProblem>(MakeGroupWorld(poses, pairs, &store_), options_.ba);
}

std::unique_ptr<BaProblem> GlobalBa::Local(const MapPoses& poses) {
  const AdjustedGroup& adjusted = refined_.at(work_->state->group).adjusted;
  const LocalPart part = ChooseLocalPart(poses, adjusted, pairs_, work_->new_pairs,
                                         options_.local.max_neighbours, &store_);
  std::vector<MatchedPair> pairs;
  for (const std::set<KeyframeId>* keyframes : {&part.moving, &part.fixed}) {
    for (const KeyframeId& id : *keyframes) {
      for (const KeyframePair& pair : pairs_.OfQuery(id)) {
        if (part.moving.contains(pair.second) || part.fixed.contains(pair.second)) {
          AddPair(pair, &pairs);
        }
      }
    }
  }
  return std::make_unique<BaProblem>(MakeLocalWorld(poses, part, adjusted, pairs, &store_),
                                     options_.ba);
}

void GlobalBa::AddPair(const KeyframePair& pair, std::vector<MatchedPair>* pairs) {
  const auto corners = matched_.find(pair);
  const auto record =
      corners == matched_.end() ? std::nullopt : corners->second.Bytes(records_.get());
  if (record) {
    pairs->push_back({pair.first, pair.second, CornersFromRecord(*record)});
  }
}

MapState GlobalBa::Finish() {
  const std::unique_ptr<Work> work = std::exchange(work_, nullptr);
  const BaWorld& world = work->problem->world();
  MapState refined = *work->state;
  const MapPoses poses = PosesOf(refined);
  for (const MapId& map : refined.maps) {
    if (map != refined.group) {
      refined_.erase(map);
    }
  }
  Refined& known = refined_[refined.group];
  known.basis = BasisOf(refined);
  if (work->local) {
    const double shift = LargestShift(world, known.adjusted, poses);
    known.whole_is_due = shift > options_.local.max_shift_m;
    known.adjusted = AfterAdjustment(world, poses, &known.adjusted);
  } else {
    known.whole_is_due = false;
    known.whole_keyframes = refined.keyframes.size();
    known.adjusted = AfterAdjustment(world, poses, nullptr);
  }
  for (const auto& [id, utime, told] : std::exchange(refined.keyframes, {})) {
    if (const KeyframeState* state = known.adjusted.Find(id)) {
      refined.keyframes.push_back({id, utime, state->T_map_body});
    }
  }
  std::ranges::sort(refined.keyframes, {}, &KeyframePose::id);
  ++counters_.finished;
  counters_.finished_local += work->local ? 1 : 0;
  return known.state = std::move(refined);
}

}  // namespace pangea

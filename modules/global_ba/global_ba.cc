#include "global_ba/global_ba.h"

#include <algorithm>
#include <cmath>

#include "core/byte_record.h"

namespace pangea {
namespace {

// Whether a state has the shape of a refinement: the same steps from keyframe to keyframe.
bool HasShape(const MapState& state, const std::vector<KeyframePose>& refined) {
  constexpr double kSame_m = 1e-4;
  std::map<KeyframeId, Eigen::Vector3d> positions;
  for (const KeyframePose& pose : state.keyframes) {
    positions[pose.id] = pose.T_map_body.t;
  }
  for (size_t i = 1; i < refined.size(); ++i) {
    const auto from = positions.find(refined[i - 1].id), to = positions.find(refined[i].id);
    if (from == positions.end() || to == positions.end()) {
      return false;
    }
    const double step = (refined[i].T_map_body.t - refined[i - 1].T_map_body.t).norm();
    if (std::abs((to->second - from->second).norm() - step) > kSame_m) {
      return false;
    }
  }
  return true;
}

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
  writer->PutCount(tied_.size());
  for (const Pair& pair : tied_) {
    writer->Put(pair.first);
    writer->Put(pair.second);
  }
  store_.Save(writer);
}

bool GlobalBa::Restore(ByteReader* reader) {
  std::map<Pair, Record> matched;
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    Pair pair;
    std::vector<uint8_t> corners;
    reader->Get(&pair.first);
    reader->Get(&pair.second);
    reader->Get(&corners);
    matched.emplace_hint(matched.end(), pair, Record(std::move(corners), records_.get()));
  }
  std::set<Pair> tied;
  for (size_t left = reader->GetCount(1); left > 0; --left) {
    Pair pair;
    reader->Get(&pair.first);
    reader->Get(&pair.second);
    tied.insert(tied.end(), pair);
  }
  if (!store_.Restore(reader) || !reader->at_end()) {
    return false;
  }
  matched_ = std::move(matched);
  tied_ = std::move(tied);
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
    const Pair pair(match.query, candidate.match);
    if (matched_.size() < kMaxMatched && !matched_.contains(pair)) {
      matched_.emplace(pair, Record(ToRecord(candidate.corner_matches), records_.get()));
    }
  }
}

void GlobalBa::Take(const Constraint& constraint) {
  const Pair pair(constraint.to, constraint.from);
  if (constraint.accepted) {
    if (tied_.insert(pair).second) {
      DropIfAbout(constraint.to.map);
    }
  } else if (constraint.reason == kRedundant) {
    tied_.insert(pair);
  } else {
    matched_.erase(pair);
  }
}

void GlobalBa::Take(MapState state) {
  std::ranges::sort(state.maps);
  const auto shared = std::make_shared<const MapState>(std::move(state));
  for (const MapId& map : shared->maps) {
    StatePointer& current = states_[map];
    if (current == nullptr || current->revision < shared->revision) {
      current = shared;
    }
  }
  const auto refined = refined_.find(shared->group);
  if (refined != refined_.end() && refined->second.first == BasisOf(*shared) &&
      !HasShape(*shared, refined->second.second)) {
    refined_.erase(refined);
  }
  if (in_work_ != nullptr && BasisOf(*states_[in_work_->group]) != BasisOf(*in_work_)) {
    DropIfAbout(in_work_->group);
  }
}

void GlobalBa::DropIfAbout(const MapId& map) {
  if (in_work_ != nullptr && std::ranges::binary_search(in_work_->maps, map)) {
    problem_.reset();
    in_work_.reset();
    ++counters_.dropped;
  }
}

GlobalBa::Basis GlobalBa::BasisOf(const MapState& state) {
  return {state.maps, state.keyframes.size(), state.num_constraints, state.num_switched_off};
}

GlobalBa::StatePointer GlobalBa::NextDue() const {
  for (const auto& [map, state] : states_) {
    const auto is_current = [&, &state = state](const MapId& m) { return states_.at(m) == state; };
    const auto known = refined_.find(state->group);
    if (map == state->group && state->num_constraints > 0 &&
        static_cast<int>(state->keyframes.size()) >= options_.min_keyframes &&
        std::ranges::all_of(state->maps, is_current) &&
        (known == refined_.end() || known->second.first != BasisOf(*state))) {
      return state;
    }
  }
  return nullptr;
}

std::optional<MapState> GlobalBa::Advance() {
  if (problem_ == nullptr) {
    if (StatePointer due = NextDue()) {
      Begin(std::move(due));
    }
    return std::nullopt;
  }
  if (problem_->Advance()) {
    return std::nullopt;
  }
  MapState refined = Refined();
  refined_[in_work_->group] = {BasisOf(*in_work_), refined.keyframes};
  problem_.reset();
  in_work_.reset();
  ++counters_.finished;
  return refined;
}

void GlobalBa::Begin(StatePointer state) {
  std::vector<MatchedPlaces> places;
  for (const MapId& map : state->maps) {
    for (auto pair = tied_.lower_bound({{map, 0}, {}});
         pair != tied_.end() && pair->first.map == map; ++pair) {
      const auto corners = matched_.find(*pair);
      const auto record =
          corners == matched_.end() ? std::nullopt : corners->second.Bytes(records_.get());
      if (record) {
        places.push_back({pair->first, pair->second, CornersFromRecord(*record)});
      }
    }
  }
  problem_ = std::make_unique<BaProblem>(MakeGroupWorld(*state, places, options_.world, &store_),
                                         options_.ba);
  in_work_ = std::move(state);
  ++counters_.begun;
}

MapState GlobalBa::Refined() const {
  MapState refined = *in_work_;
  refined.keyframes.clear();
  for (const BaKeyframe& keyframe : problem_->world().keyframes) {
    refined.keyframes.push_back({keyframe.id, keyframe.utime, keyframe.imu.T_odom_body});
  }
  return refined;
}

}  // namespace pangea

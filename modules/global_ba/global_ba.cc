#include "global_ba/global_ba.h"

#include <algorithm>

namespace pangea {

void GlobalBa::Take(Keyframe keyframe) {
  if (!store_.Contains(keyframe.id)) {
    DropIfAbout(keyframe.id.map);
    store_.Add(std::move(keyframe));
  }
}

void GlobalBa::Take(const PlaceMatch& match) {
  for (const PlaceCandidate& candidate : match.candidates) {
    matched_.try_emplace({match.query, candidate.match}, candidate.corner_matches);
  }
}

void GlobalBa::Take(const Constraint& constraint) {
  const Pair pair(constraint.to, constraint.from);
  if (!constraint.accepted) {
    matched_.erase(pair);
  } else if (accepted_.insert(pair).second) {
    DropIfAbout(constraint.to.map);
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
        (known == refined_.end() || known->second != BasisOf(*state))) {
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
  refined_[in_work_->group] = BasisOf(*in_work_);
  problem_.reset();
  in_work_.reset();
  ++counters_.finished;
  return refined;
}

void GlobalBa::Begin(StatePointer state) {
  std::vector<MatchedPlaces> places;
  for (const Pair& pair : accepted_) {
    const auto corners = matched_.find(pair);
    if (corners != matched_.end()) {
      places.push_back({pair.first, pair.second, corners->second});
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

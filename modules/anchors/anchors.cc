#include "anchors/anchors.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <limits>
#include <ranges>
#include <tuple>
#include <utility>

namespace pangea {
namespace {

constexpr int kHolds = 8;  // maximum number of keyframes that hold an anchor
constexpr size_t kMaxNotPlaced = 100;
constexpr int kMaxCorrections = 3;
// An anchor that an agent hears of stays near up to this multiple of the distance at which it came,
// so that it does not come and go.
constexpr double kStaysNear = 1.2;

// Expresses the covariance of a transform in a rotated left frame.
Matrix6d Rotated(const Eigen::Matrix3d& R, const Matrix6d& covariance) {
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = R;
  J.bottomRightCorner<3, 3>() = R;
  return J * covariance * J.transpose();
}

}  // namespace

void Anchors::Take(const Keyframe& keyframe) {
  const MapId& map = keyframe.id.map;
  tracks_.try_emplace(map, records_.get()).first->second.Add(keyframe);
  positions_.reset();
  if (const auto waiting = waiting_.extract(map); !waiting.empty()) {
    for (const AnchorId& id : waiting.mapped()) {
      PlaceOrWait(id);
    }
  }
}

std::string Anchors::Take(const AnchorEdit& edit) {
  std::string refused = registry_.Take(edit);
  if (refused.empty() && edit.placement != AnchorEdit::Placement::kSame) {
    PlaceOrWait(edit.anchor);
  }
  return refused;
}

PlacementResult Anchors::Try(const AnchorEdit& edit, bool ended) const {
  static const OdometryTrack kNoKeyframes;
  const auto track = tracks_.find(edit.map);
  return Place(edit, track == tracks_.end() ? kNoKeyframes : track->second, kHolds, ended);
}

std::optional<Rigid3> Anchors::TryInGroup(const AnchorEdit& edit) const {
  const PlacementResult result = Try(edit);
  const auto* const placement = std::get_if<AnchorPlacement>(&result);
  return placement == nullptr ? std::nullopt : std::optional(Position(*placement).T_map_anchor);
}

// Several keyframes will hold the anchor, and the optimised map does not have them exactly where
// their odometry has them. The closest result counts: a correction may change which ones hold it.
void Anchors::MakeExact(AnchorEdit* edit) const {
  const auto track = tracks_.find(edit->map);
  if (edit->placement != AnchorEdit::Placement::kKeyframe || track == tracks_.end() ||
      track->second.Find(edit->keyframe_seq) == nullptr) {
    return;
  }
  const Rigid3 T_map_anchor = T_map_body(edit->map, edit->keyframe_seq) * edit->T_ref_anchor;
  AnchorEdit corrected = *edit;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i <= kMaxCorrections; ++i) {
    const auto result = TryInGroup(corrected);
    if (!result) {
      return;
    }
    if (const double off = result->Minus(T_map_anchor).norm(); off < least) {
      least = off;
      edit->T_ref_anchor = corrected.T_ref_anchor;
    }
    corrected.T_ref_anchor = corrected.T_ref_anchor * (result->Inverse() * T_map_anchor);
  }
}

// The newest edit that can be placed counts, in whatever order edits and keyframes come: while it
// waits for a keyframe, or if its placement fails, an older one does.
void Anchors::PlaceOrWait(const AnchorId& id, const std::optional<MapId>& ended) {
  Tries& tries = tries_[id];
  for (const auto& [order, edit] : std::views::reverse(registry_.entries().at(id).places)) {
    if (order <= tries.placed) {
      return;
    }
    if (tries.failed.contains(order)) {
      continue;
    }
    PlacementResult result = Try(edit, edit.map == ended);
    if (auto* const placement = std::get_if<AnchorPlacement>(&result)) {
      placements_[id] = std::move(*placement);
      tries.placed = order;
      positions_.reset();
      return;
    }
    if (const auto* const not_placed = std::get_if<NotPlaced>(&result)) {
      tries.failed.insert(order);
      if (not_placed_.size() < kMaxNotPlaced) {
        not_placed_.push_back(
            fmt::format("anchor {} \"{}\": {}", ToString(id), edit.name, not_placed->reason));
      }
    } else {
      waiting_[edit.map].insert(id);
    }
  }
}

void Anchors::PlaceInEndedMaps() {
  std::map<MapId, int32_t> newest_seqs;
  for (const auto& [map, ids] : waiting_) {
    if (const auto track = tracks_.find(map); track != tracks_.end()) {
      newest_seqs[map] = track->second.keyframes().rbegin()->first;
    }
  }
  for (const auto& [map, seq] : newest_seqs) {
    if (const auto before = newest_seqs_.find(map);
        before != newest_seqs_.end() && before->second == seq) {
      const auto waiting = waiting_.extract(map);
      for (const AnchorId& id : waiting.mapped()) {
        PlaceOrWait(id, map);
      }
    }
  }
  newest_seqs_ = std::move(newest_seqs);
}

size_t Anchors::num_waiting() const {
  std::set<AnchorId> ids;
  for (const auto& [map, waiting] : waiting_) {
    std::ranges::copy_if(waiting, std::inserter(ids, ids.end()), [this](const AnchorId& id) {
      return !registry_.entries().at(id).deleted;
    });
  }
  return ids.size();
}

void Anchors::Take(const MapState& state) {
  positions_.reset();
  groups_.Take(PosedGroup(state));
}

void Anchors::Take(const Correction& correction) {
  Correction& newest = corrections_[correction.map];
  if (newest.revision < correction.revision) {
    newest = correction;
  }
}

std::vector<MapId> Anchors::AgentMaps() const {
  std::vector<MapId> maps;
  for (const auto& [map, track] : tracks_) {
    if (!maps.empty() && maps.back().agent_id == map.agent_id) {
      maps.back() = map;
    } else {
      maps.push_back(map);
    }
  }
  for (MapId& map : maps) {
    const auto current = current_maps_.find(map.agent_id);
    if (current != current_maps_.end() && tracks_.contains(current->second)) {
      map = current->second;
    }
  }
  return maps;
}

Rigid3 Anchors::T_map_odom(const MapId& map) const {
  const PosedGroup* const group = groups_.Find(map);
  const auto track = tracks_.find(map);
  if (group == nullptr || track == tracks_.end()) {
    return {};
  }
  // The newest keyframe in both the state and the track.
  auto it = group->T_map_body.upper_bound({map, std::numeric_limits<int32_t>::max()});
  while (it != group->T_map_body.begin() && (--it)->first.map == map) {
    if (const TrackedKeyframe* const keyframe = track->second.Find(it->first.seq)) {
      return it->second * keyframe->T_odom_body.Inverse();
    }
  }
  return {};
}

std::optional<Rigid3> Anchors::T_body_cam(const MapId& map) const {
  const auto track = tracks_.find(map);
  return track == tracks_.end()
             ? std::nullopt
             : std::optional(track->second.keyframes().rbegin()->second.camera->T_body_cam);
}

// A keyframe that is not in the group's state yet is placed by odometry, from the newest one that
// is.
Rigid3 Anchors::T_map_body(const MapId& map, int32_t seq) const {
  if (const PosedGroup* const group = groups_.Find(map)) {
    const auto found = group->T_map_body.find({map, seq});
    if (found != group->T_map_body.end()) {
      return found->second;
    }
  }
  return T_map_odom(map) * tracks_.at(map).Find(seq)->T_odom_body;
}

Anchors::InGroup Anchors::Position(const AnchorPlacement& placement) const {
  std::vector<Rigid3> poses;
  InGroup mean{{Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()}, Matrix6d::Zero()};
  for (const Hold& hold : placement.holds) {
    poses.push_back(T_map_body(placement.map, hold.seq) * hold.T_body_anchor);
    mean.T_map_anchor.t += hold.weight * poses.back().t;
    mean.T_map_anchor.q = poses.front().q;
  }
  // Average the rotations in the tangent space of the first one; they are nearly equal.
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
  Matrix6d spread = Matrix6d::Zero();
  for (size_t i = 0; i < poses.size(); ++i) {
    rotation += placement.holds[i].weight * LogSo3(poses[i].q * mean.T_map_anchor.q.conjugate());
    const Eigen::Vector3d off = poses[i].t - mean.T_map_anchor.t;
    spread.topLeftCorner<3, 3>() += placement.holds[i].weight * off * off.transpose();
  }
  mean.T_map_anchor.q = (ExpSo3(rotation) * mean.T_map_anchor.q).normalized();
  mean.covariance = Rotated(T_map_odom(placement.map).R(), placement.covariance) + spread;
  return mean;
}

const std::map<AnchorId, Anchors::InGroup>& Anchors::Positions() const {
  if (!positions_) {
    positions_.emplace();
    for (const auto& [id, placement] : placements_) {
      positions_->emplace(id, Position(placement));
    }
  }
  return *positions_;
}

bool Anchors::SameGroup(const MapId& a, const MapId& b) const {
  const PosedGroup *const group_a = groups_.Find(a), *const group_b = groups_.Find(b);
  return a == b || (group_a != nullptr && group_b != nullptr && group_a->id == group_b->id);
}

AnchorState Anchors::Describe(const AnchorId& id, const MapId& map) const {
  const AnchorEntry& entry = registry_.entries().at(id);
  AnchorState state;
  state.anchor = id;
  state.revision = entry.revision;
  state.edited_by = entry.edited_by;
  state.gone = entry.deleted;
  state.name = entry.name;
  state.payload = entry.deleted ? "" : entry.payload;
  state.map = map;
  std::tie(state.group, state.group_revision) = GroupAndRevision(map);
  return state;
}

// Deleted anchors of the map's group, the newest first.
std::vector<AnchorId> Anchors::DeletedOf(const MapId& map) const {
  std::vector<AnchorId> deleted;
  for (const auto& [id, placement] : placements_) {
    if (registry_.entries().at(id).deleted && SameGroup(map, placement.map)) {
      deleted.push_back(id);
    }
  }
  std::ranges::stable_sort(deleted, std::greater(), &AnchorId::created_utime);
  deleted.resize(std::min<size_t>(deleted.size(), options_.max_near));
  return deleted;
}

// The nearest of its group first; one that was told counts as nearer than it is.
std::vector<AnchorId> Anchors::Near(const MapId& map, const Rigid3& T_odom_map,
                                    const Eigen::Vector3d& p_odom_agent,
                                    const std::set<AnchorId>& told) const {
  std::vector<std::pair<double, AnchorId>> near;
  for (const auto& [id, position] : Positions()) {
    const double away_m = (T_odom_map * position.T_map_anchor.t - p_odom_agent).norm() /
                          (told.contains(id) ? kStaysNear : 1);
    if (away_m <= options_.near_m && !registry_.entries().at(id).deleted &&
        SameGroup(map, placements_.at(id).map)) {
      near.emplace_back(away_m, id);
    }
  }
  std::ranges::sort(near);
  near.resize(std::min<size_t>(near.size(), options_.max_near));
  std::vector<AnchorId> ids;
  for (const auto& [away_m, id] : near) {
    ids.push_back(id);
  }
  return ids;
}

std::vector<AnchorState> Anchors::ForAgent(const MapId& map, const std::set<AnchorId>& told) const {
  const auto track = tracks_.find(map);
  if (track == tracks_.end()) {
    return {};
  }
  const Rigid3 T_odom_map = T_map_odom(map).Inverse();
  const auto correction = corrections_.find(map);
  const Matrix6d correction_covariance =
      correction == corrections_.end() ? Matrix6d(Matrix6d::Zero()) : correction->second.covariance;
  const Matrix6d frame_covariance = InverseCovariance(T_odom_map.Inverse(), correction_covariance);
  const Eigen::Vector3d p_odom_agent = track->second.keyframes().rbegin()->second.T_odom_body.t;
  std::vector<AnchorState> states;
  std::set<AnchorId> untold = told;
  for (const AnchorId& id : Near(map, T_odom_map, p_odom_agent, told)) {
    untold.erase(id);
    const InGroup& position = Positions().at(id);
    AnchorState& state = states.emplace_back(Describe(id, map));
    state.T_odom_anchor = T_odom_map * position.T_map_anchor;
    // The uncertainty of the map's pose in the group does not concern its own anchors: they move
    // with it.
    const bool own = placements_.at(id).map == map;
    state.covariance =
        ComposeCovariance(T_odom_map, own ? Matrix6d(Matrix6d::Zero()) : frame_covariance,
                          position.T_map_anchor, position.covariance);
  }
  for (const AnchorId& id : DeletedOf(map)) {
    untold.erase(id);
    states.push_back(Describe(id, map));
  }
  for (const AnchorId& id : untold) {
    states.emplace_back(Describe(id, map)).gone = true;
  }
  return states;
}

std::vector<AnchorState> Anchors::All() const {
  std::vector<AnchorState> states;
  for (const auto& [id, position] : Positions()) {
    states.push_back(*InItsGroup(id));
  }
  return states;
}

std::optional<AnchorState> Anchors::InItsGroup(const AnchorId& id) const {
  const auto position = Positions().find(id);
  if (position == Positions().end()) {
    return std::nullopt;
  }
  AnchorState state = Describe(id, placements_.at(id).map);
  state.map = state.group;
  state.T_odom_anchor = position->second.T_map_anchor;
  state.covariance = position->second.covariance;
  return state;
}

std::pair<MapId, int64_t> Anchors::GroupAndRevision(const MapId& map) const {
  const PosedGroup* const group = groups_.Find(map);
  return group == nullptr ? std::pair(map, int64_t{0}) : std::pair(group->id, group->revision);
}

bool Anchors::HasGroup(const MapId& group) const {
  return std::ranges::any_of(
      tracks_, [&](const auto& item) { return GroupAndRevision(item.first).first == group; });
}

std::optional<Anchors::NearKeyframe> Anchors::NearestKeyframe(const MapId& group,
                                                              const Eigen::Vector3d& p_map) const {
  std::optional<NearKeyframe> nearest;
  for (const auto& [map, track] : tracks_) {
    if (GroupAndRevision(map).first != group) {
      continue;
    }
    for (const auto& [seq, keyframe] : track.keyframes()) {
      const Rigid3 T = T_map_body(map, seq);
      if (!nearest || (T.t - p_map).norm() < (nearest->T_map_body.t - p_map).norm()) {
        nearest = {{map, seq}, T};
      }
    }
  }
  return nearest;
}

const TrackedKeyframe* Anchors::NewestKeyframe(const MapId& map) const {
  const auto track = tracks_.find(map);
  return track == tracks_.end() || track->second.keyframes().empty()
             ? nullptr
             : &track->second.keyframes().rbegin()->second;
}

RecordCounters Anchors::store_counters() const {
  RecordCounters sum;
  for (const auto& [map, track] : tracks_) {
    sum.in_memory += track.counters().in_memory;
    sum.unreadable += track.counters().unreadable;
  }
  return sum;
}

size_t Anchors::num_placed() const {
  return static_cast<size_t>(std::ranges::count_if(placements_, [this](const auto& item) {
    return !registry_.entries().at(item.first).deleted;
  }));
}

}  // namespace pangea

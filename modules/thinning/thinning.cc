#include "thinning/thinning.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "anchors/placement.h"
#include "core/median.h"
#include "place_recognition/two_views.h"

namespace pangea {
namespace {

constexpr double kUsualDepth_m = 3;  // scene depth of a keyframe without points
constexpr double kHour_us = 3.6e9;

// A copy without the large parts: corners, and all map points except the one with the median depth.
Keyframe Skeleton(const Keyframe& keyframe) {
  Keyframe skeleton = keyframe;
  skeleton.corners.clear();
  if (!keyframe.points.empty()) {
    std::vector<float> inverse_depths;
    for (const MapPoint& point : keyframe.points) {
      inverse_depths.push_back(point.inverse_depth);
    }
    skeleton.points = {{0, Median(std::move(inverse_depths)), 1}};
  }
  skeleton.corners.shrink_to_fit();
  skeleton.points.shrink_to_fit();
  return skeleton;
}

double Depth(const Keyframe& skeleton) {
  return skeleton.points.empty() ? kUsualDepth_m : 1.0 / skeleton.points.front().inverse_depth;
}

}  // namespace

Thinning::Thinning(const Options& options, std::shared_ptr<RecordStore> records)
    : options_(options),
      recognised_(std::move(records)),
      anchors_(std::numeric_limits<size_t>::max()) {}

void Thinning::Take(const Keyframe& keyframe, int64_t journalled_utime) {
  const auto [it, is_new] = stored_.try_emplace(keyframe.id.map);
  if (is_new) {
    maps_.push_back(keyframe.id.map);
  }
  StoredMap& map = it->second;
  const auto seq_of = [](const Keyframe& stored) { return stored.id.seq; };
  const auto at = std::ranges::lower_bound(map.keyframes, keyframe.id.seq, {}, seq_of);
  if (at != map.keyframes.end() && at->id.seq == keyframe.id.seq) {
    return;
  }
  const bool stored = recognised_.Add(RecognisedKeyframe(keyframe));
  map.numbers.insert(map.numbers.begin() + (at - map.keyframes.begin()),
                     stored ? recognised_.size() - 1 : kNotStored);
  map.keyframes.insert(at, Skeleton(keyframe));
  map.journalled_utime = std::max(map.journalled_utime, journalled_utime);
}

void Thinning::Take(const Constraint& constraint) {
  constraints_.try_emplace(constraint.Id(), constraint);
}

void Thinning::Take(const AnchorEdit& edit) { anchors_.Take(edit); }

ThinnedMaps Thinning::Thin(int64_t now_utime) {
  const Solution before = Solve({});
  std::set<MapId> whole = Whole(before, now_utime);
  ThinnedMaps thinned = Make(before, whole);
  if (const std::set<MapId> groups = ComeApart(before, thinned); !groups.empty()) {
    for (const auto& [map, group] : before.group_of) {
      if (groups.contains(group)) {
        whole.insert(map);
      }
    }
    thinned = Make(before, whole);
  }
  return thinned;
}

ThinnedMaps Thinning::Make(const Solution& solution, const std::set<MapId>& whole) {
  ThinnedMaps thinned;
  thinned.gone = Gone(solution, whole);
  JoinEdges(&thinned);
  thinned.derived = Derive(solution, thinned.gone);
  return thinned;
}

std::set<MapId> Thinning::Whole(const Solution& solution, int64_t now_utime) const {
  std::set<MapId> whole;
  for (const auto& [map, group] : solution.group_of) {
    whole.insert(group);  // a group has the id of its oldest map
  }
  for (const auto& [id, map] : stored_) {
    const auto age_us = static_cast<double>(now_utime - map.journalled_utime);
    if (age_us < kHour_us * options_.thinning.keep_hours) {
      whole.insert(id);
    }
  }
  return whole;
}

// The keyframes that place an anchor by this edit.
void Thinning::Keep(const AnchorEdit& place, std::set<KeyframeId>* must_stay) const {
  const auto map = stored_.find(place.map);
  if (map == stored_.end()) {
    return;
  }
  const std::vector<Keyframe>& keyframes = map->second.keyframes;
  int64_t utime = place.utime;
  if (place.placement == AnchorEdit::Placement::kKeyframe) {
    const auto at = std::ranges::lower_bound(keyframes, place.keyframe_seq, {},
                                             [](const Keyframe& k) { return k.id.seq; });
    utime = at == keyframes.end() ? keyframes.back().utime : at->utime;
  }
  // Include one keyframe before and one after the reach: a stationary body has few keyframes.
  const auto first =
      std::ranges::lower_bound(keyframes, utime - kPlacementReach_us, {}, &Keyframe::utime);
  const auto last =
      std::ranges::upper_bound(keyframes, utime + kPlacementReach_us, {}, &Keyframe::utime);
  for (auto it = first == keyframes.begin() ? first : first - 1;
       it != keyframes.end() && it <= last; ++it) {
    must_stay->insert(it->id);
  }
}

std::set<KeyframeId> Thinning::MustStay(const Solution& solution) const {
  std::set<KeyframeId> must_stay;
  for (const auto& [id, anchor] : anchors_.entries()) {
    for (const auto& [order, place] : anchor.places) {
      if (!anchor.deleted) {
        Keep(place, &must_stay);
      }
    }
  }
  for (const auto& [id, constraint] : constraints_) {
    const auto from = solution.group_of.find(constraint.from.map);
    const auto to = solution.group_of.find(constraint.to.map);
    if (constraint.accepted && from != solution.group_of.end() && to != solution.group_of.end() &&
        from->second != to->second) {
      must_stay.insert({constraint.from, constraint.to});
    }
  }
  return must_stay;
}

std::set<KeyframeId> Thinning::Gone(const Solution& solution, const std::set<MapId>& whole) {
  const std::set<KeyframeId> must_stay = MustStay(solution);
  std::map<MapId, int> group_numbers;
  std::set<KeyframeId> recognised;
  for (const auto& [id, constraint] : constraints_) {
    if (solution.in_force.contains(id) && constraint.from.map != constraint.to.map) {
      recognised.insert({constraint.from, constraint.to});
    }
  }
  const std::vector<MapId> newest_first(maps_.rbegin(), maps_.rend());
  std::vector<MapViews> views;
  for (const MapId& id : newest_first) {
    MapViews map;
    const MapId& group = solution.group_of.at(id);
    map.group =
        group_numbers.try_emplace(group, static_cast<int>(group_numbers.size())).first->second;
    const double scale = std::exp(solution.log_scale.at(id));
    for (const Keyframe& keyframe : stored_.at(id).keyframes) {
      map.views.push_back({solution.T_map_body.at(keyframe.id) * keyframe.camera.T_body_cam,
                           scale * Depth(keyframe),
                           whole.contains(id) || must_stay.contains(keyframe.id),
                           recognised.contains(keyframe.id)});
    }
    views.push_back(std::move(map));
  }
  const auto looks_alike = [&](const ViewRef& a, const ViewRef& b) {
    return LookAlike(stored_.at(newest_first[a.map]).numbers[a.view],
                     stored_.at(newest_first[b.map]).numbers[b.view]);
  };
  const std::vector<std::vector<bool>> kept =
      ChooseViews(views, looks_alike, options_.thinning.coverage);
  std::set<KeyframeId> gone;
  for (size_t m = 0; m < kept.size(); ++m) {
    for (size_t i = 0; i < kept[m].size(); ++i) {
      if (!kept[m][i]) {
        gone.insert(stored_.at(newest_first[m]).keyframes[i].id);
      }
    }
  }
  return gone;
}

bool Thinning::LookAlike(int a, int b) {
  const auto view_a = a == kNotStored ? nullptr : recognised_.Find(a);
  const auto view_b = b == kNotStored ? nullptr : recognised_.Find(b);
  return view_a != nullptr && view_b != nullptr && CheckTwoViews(*view_a, *view_b).accepted();
}

}  // namespace pangea

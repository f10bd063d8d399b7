#include "uplink/pose_history.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace pangea {
namespace {

Rigid3 Between(const Rigid3& a, const Rigid3& b, double share) {
  return {a.q.slerp(share, b.q), a.t + share * (b.t - a.t)};
}

double Share(int64_t utime, int64_t from, int64_t to) {
  return static_cast<double>(utime - from) / static_cast<double>(to - from);
}

// The first item at or after that time.
template <typename Stamped>
typename std::deque<Stamped>::const_iterator FirstFrom(const std::deque<Stamped>& items,
                                                       int64_t utime) {
  return std::lower_bound(items.begin(), items.end(), utime,
                          [](const Stamped& item, int64_t time) { return item.utime < time; });
}

}  // namespace

void PoseHistory::AddPose(int64_t utime, const MapId& map, const Rigid3& T_odom_body) {
  if (map != now_.map) {
    before_ = std::exchange(now_, {map, {}, {}});
  }
  std::deque<Entry>& poses = now_.poses;
  if (!poses.empty() && utime <= poses.back().utime) {
    return;
  }
  poses.push_back({utime, T_odom_body});
  while (poses.size() > kMaxPoses || utime - poses.front().utime > kLength_us) {
    poses.pop_front();
  }
}

void PoseHistory::AddKeyframe(int64_t utime, const MapId& map, const Rigid3& T_odom_body) {
  auto live = map == now_.map ? now_.Live(utime) : std::nullopt;
  std::deque<Correction>& corrections = now_.corrections;
  if (!live || (!corrections.empty() && utime <= corrections.back().utime)) {
    return;  // a repeat, or older than the poses that are kept
  }
  corrections.push_back({utime, T_odom_body * live->Inverse()});
  while (utime - corrections.front().utime > kLength_us) {
    corrections.pop_front();
  }
}

std::optional<Rigid3> PoseHistory::OfMap::Live(int64_t utime) const {
  const auto after = FirstFrom(poses, utime);
  if (after == poses.end()) {
    return std::nullopt;
  }
  if (after->utime == utime) {
    return after->T_odom_body;
  }
  if (after == poses.begin() || after->utime - std::prev(after)->utime > kMaxGap_us) {
    return std::nullopt;
  }
  const Entry& before = *std::prev(after);
  return Between(before.T_odom_body, after->T_odom_body, Share(utime, before.utime, after->utime));
}

std::optional<Rigid3> PoseHistory::At(int64_t utime, const MapId& map) const {
  const OfMap& of_map = map == before_.map ? before_ : now_;
  auto live = map == of_map.map ? of_map.Live(utime) : std::nullopt;
  const std::deque<Correction>& corrections = of_map.corrections;
  if (!live || corrections.empty()) {
    return live;
  }
  const auto after = FirstFrom(corrections, utime);
  if (after == corrections.begin()) {
    return after->T_odom_live * *live;
  }
  const Rigid3 by_before = std::prev(after)->T_odom_live * *live;
  if (after == corrections.end()) {
    return by_before;
  }
  return Between(by_before, after->T_odom_live * *live,
                 Share(utime, std::prev(after)->utime, after->utime));
}

bool PoseHistory::IsSettled(int64_t utime, const MapId& map) const {
  return (map == before_.map && !before_.poses.empty()) ||
         (map == now_.map && !now_.corrections.empty() && now_.corrections.back().utime >= utime);
}

}  // namespace pangea

#include "uplink/shown_anchors.h"

#include <algorithm>

namespace pangea {
namespace {

constexpr int64_t kMovingInterval_us = 50'000;
constexpr int64_t kIdleInterval_us = 1'000'000;
constexpr double kSpeed = 0.1, kMaxSpeed = 0.25;  // m/s
constexpr double kRotationSpeed = 0.2;            // rad/s
// Less than 3 s, because a step always counts as 50 ms, even if Poll was called a little later.
constexpr double kWay_s = 2.7;

// More than a correction that the server does not send at once (kAnchorMoved_m).
constexpr double kMovedByPeople_m = 0.005, kMovedByPeople_rad = 0.005;

bool HaveMoved(const Rigid3& before, const Rigid3& now) {
  const Vector6d way = now.Minus(before);
  return way.head<3>().norm() > kMovedByPeople_m || way.tail<3>().norm() > kMovedByPeople_rad;
}

bool Same(const Rigid3& a, const Rigid3& b) { return a.t == b.t && a.q.coeffs() == b.q.coeffs(); }

}  // namespace

void ShownAnchorsBlend::Set(const AnchorState& state) {
  any_ever_ = true;
  if (state.gone) {
    return Erase(state.anchor);
  }
  const auto [it, is_new] = anchors_.try_emplace(state.anchor);
  Entry& entry = it->second;
  const bool edited = entry.revision != state.revision || entry.edited_by != state.edited_by;
  changed_ = changed_ || edited;
  entry.revision = state.revision;
  entry.edited_by = state.edited_by;
  if (is_new || entry.map != state.map ||
      (edited && HaveMoved(entry.T_odom_anchor, state.T_odom_anchor))) {
    entry.map = state.map;
    entry.T_odom_anchor = entry.T_odom_shown = state.T_odom_anchor;
    entry.speed = 0;
    changed_ = true;
  } else if (!Same(entry.T_odom_anchor, state.T_odom_anchor)) {
    entry.T_odom_anchor = state.T_odom_anchor;
    const double way = (entry.T_odom_anchor.t - entry.T_odom_shown.t).norm();
    // A further correction must not slow it down.
    entry.speed = std::max(entry.speed, std::clamp(way / kWay_s, kSpeed, kMaxSpeed));
  }
  Look();
}

void ShownAnchorsBlend::Erase(const AnchorId& id) {
  changed_ = anchors_.erase(id) > 0 || changed_;
  Look();
}

void ShownAnchorsBlend::OnPose(int64_t utime, const MapId& map) {
  has_pose_ = true;
  changed_ = changed_ || map_ != map;
  map_ = map;
  utime_ = utime;
  Look();
}

void ShownAnchorsBlend::OnKeyframe(int64_t utime, const MapId& map) {
  const bool newer = !map_ || *map_ < map || (*map_ == map && utime_ < utime);
  if (!has_pose_ && newer) {
    OnPose(utime, map);
    has_pose_ = false;
  }
}

void ShownAnchorsBlend::Look() {
  moving_ = std::any_of(anchors_.begin(), anchors_.end(), [this](const auto& item) {
    return item.second.map == map_ && item.second.speed > 0;
  });
}

// Moves the shown pose by one step. Returns whether it still differs from the true pose.
bool ShownAnchorsBlend::Step(double seconds, Entry* entry) {
  const Rigid3& target = entry->T_odom_anchor;
  Rigid3* shown = &entry->T_odom_shown;
  const Eigen::Vector3d way = target.t - shown->t;
  const Eigen::Vector3d rotation = LogSo3(target.q * shown->q.conjugate());
  const double share = std::min(1.0, entry->speed * seconds / std::max(way.norm(), 1e-9));
  const double rotated = std::min(1.0, kRotationSpeed * seconds / std::max(rotation.norm(), 1e-9));
  if (share == 1 && rotated == 1) {
    *shown = target;
    return false;
  }
  shown->t += share * way;
  shown->q = (ExpSo3(rotated * rotation) * shown->q).normalized();
  return true;
}

std::optional<ShownAnchors> ShownAnchorsBlend::Poll(int64_t now_us) {
  const int64_t since = published_us_ ? now_us - *published_us_ : kIdleInterval_us;
  const bool busy = moving_ || changed_;
  if (!any_ever_ || !map_ || since < (busy ? kMovingInterval_us : kIdleInterval_us)) {
    return std::nullopt;
  }
  published_us_ = now_us;
  changed_ = false;
  ShownAnchors shown{utime_, *map_, {}};
  for (auto& [id, entry] : anchors_) {
    if (entry.map != map_) {
      continue;
    }
    if (entry.speed > 0 && !Step(1e-6 * kMovingInterval_us, &entry)) {
      entry.speed = 0;
    }
    shown.anchors.push_back({id, entry.revision, entry.T_odom_shown});
  }
  Look();
  return shown;
}

}  // namespace pangea

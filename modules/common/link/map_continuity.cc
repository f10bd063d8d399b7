#include "common/link/map_continuity.h"

#include <iterator>

namespace pangea {
namespace {

// Extrinsics and time offset are refined as the agent walks; these are not.
bool SameCamera(const CameraModel& a, const CameraModel& b) {
  return a.kind == b.kind && a.width == b.width && a.height == b.height && a.fx == b.fx &&
         a.fy == b.fy && a.cx == b.cx && a.cy == b.cy && a.distortion == b.distortion &&
         a.readout_s == b.readout_s;
}

}  // namespace

std::string MapContinuity::Check(const Keyframe& keyframe, size_t contents) {
  const auto map = maps_.try_emplace(keyframe.id.map, Map{keyframe.camera, {}}).first;
  if (!SameCamera(map->second.camera, keyframe.camera)) {
    return "keyframe with another camera than its map's";
  }
  auto& seen = map->second.seen;
  const auto next = seen.upper_bound(keyframe.id.seq);
  auto before = seen.lower_bound(keyframe.id.seq);
  if (before != next && before->second.contents != contents) {
    return "keyframe seq used again for another keyframe";
  }
  const bool after_earlier =
      before == seen.begin() || std::prev(before)->second.utime < keyframe.utime;
  const bool before_later = next == seen.end() || keyframe.utime < next->second.utime;
  if (!after_earlier || !before_later) {
    return "keyframe's time does not go forward with its seq";
  }
  seen[keyframe.id.seq] = {keyframe.utime, contents};
  if (seen.size() > kMaxKeyframes) {
    seen.erase(seen.begin());
  }
  if (maps_.size() > kMaxMaps) {
    maps_.erase(maps_.begin());
  }
  return "";
}

}  // namespace pangea

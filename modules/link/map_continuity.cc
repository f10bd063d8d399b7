#include "link/map_continuity.h"

#include <iterator>

namespace pangea {
namespace {

// Each keyframe has the camera calibration at its time. An odometry refines extrinsics, time
// offset, focal length, centre and radial distortion, and focusing changes focal length and centre:
// by 7 per cent for a phone's 7 mm lens from infinity to 10 cm. Another lens, image size or zoom
// counts as another camera.
constexpr double kMaxChange = 0.1;            // share of the focal length
constexpr double kMaxDistortionChange = 0.5;  // of the first two coefficients: five sigmas

bool SameCamera(const CameraModel& a, const CameraModel& b) {
  const Eigen::Array4d changes{(b.fx - a.fx) / a.fx, (b.fy - a.fy) / a.fy, (b.cx - a.cx) / a.fx,
                               (b.cy - a.cy) / a.fy};
  const Eigen::Array4d distortion = (b.distortion - a.distortion).array().abs();
  return a.kind == b.kind && a.width == b.width && a.height == b.height &&
         (changes.abs() <= kMaxChange).all() &&
         (distortion.head<2>() <= kMaxDistortionChange).all() &&
         (distortion.tail<2>() == 0).all() && a.readout_s == b.readout_s;
}

}  // namespace

std::string MapContinuity::Check(const Keyframe& keyframe, size_t contents) {
  const auto map = maps_.try_emplace(keyframe.id.map, OpenMap{keyframe.camera, {}}).first;
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

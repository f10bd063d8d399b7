#include "uplink/thin.h"

#include <map>
#include <utility>
#include <vector>

namespace pangea {
namespace {

std::vector<bool> NeededCorners(const Keyframe& keyframe) {
  std::vector<bool> needed(keyframe.corners.size(), false);
  for (size_t i = 0; i < keyframe.corners.size(); ++i) {
    needed[i] = keyframe.corners[i].landmark_id != kNoLandmark;
  }
  for (const MapPoint& point : keyframe.points) {
    needed[static_cast<size_t>(point.corner)] = true;
  }
  return needed;
}

}  // namespace

Keyframe Thinned(Keyframe keyframe, int untracked) {
  std::vector<bool> kept = NeededCorners(keyframe);
  std::map<int8_t, int> of_octave;
  int total = 0;
  for (size_t i = 0; i < kept.size(); ++i) {
    if (!kept[i]) {
      ++of_octave[keyframe.corners[i].octave];
      ++total;
    }
  }
  if (total <= untracked) {
    return keyframe;
  }
  std::map<int8_t, int> left;
  for (const auto& [octave, count] : of_octave) {
    left[octave] = count * untracked / total;
  }
  std::vector<Corner> corners;
  std::vector<int> new_index(kept.size(), 0);
  for (size_t i = 0; i < kept.size(); ++i) {
    if (kept[i] || left[keyframe.corners[i].octave]-- > 0) {
      new_index[i] = static_cast<int>(corners.size());
      corners.push_back(keyframe.corners[i]);
    }
  }
  for (MapPoint& point : keyframe.points) {
    point.corner = new_index[static_cast<size_t>(point.corner)];
  }
  keyframe.corners = std::move(corners);
  return keyframe;
}

Keyframe Bare(Keyframe keyframe) {
  keyframe.corners.clear();
  keyframe.points.clear();
  return keyframe;
}

}  // namespace pangea

#include "vio/window/landmark_store.h"

#include <algorithm>
#include <set>

namespace pangea::vio {
namespace {

constexpr size_t kMinRays = 3;
constexpr double kMaxTriangulationRms = 3.0;  // sigmas

}  // namespace

std::vector<Landmark> LandmarkStore::Gather(const WindowState& state,
                                            const TrackHistory& history) const {
  std::vector<Landmark> landmarks;
  for (const int32_t id : history.Landmarks()) {
    const auto from = from_utime_.find(id);
    Landmark landmark;
    landmark.id = id;
    landmark.rays = history.RaysOf(id, state, from == from_utime_.end() ? 0 : from->second + 1);
    if (landmark.rays.size() < kMinRays) {
      continue;
    }
    const FrameRay& first = landmark.rays.front();
    const auto known = known_.find(id);
    if (known != known_.end() && known->second.anchor_utime == state.frames[first.frame].utime) {
      landmark.point = {first.frame, first.row_s, known->second.ray_rho};
    } else {
      const auto point = Triangulate(state, landmark.rays, 0);
      if (!point || point->rms > kMaxTriangulationRms) {
        continue;
      }
      landmark.point = point->point;
    }
    landmarks.push_back(std::move(landmark));
  }
  return landmarks;
}

void LandmarkStore::Keep(const WindowProblem& problem) {
  known_.clear();
  for (const Landmark& landmark : problem.landmarks) {
    known_[landmark.id] = {problem.state.frames[landmark.point.anchor].utime,
                           landmark.point.ray_rho};
  }
}

void LandmarkStore::Forget(const TrackHistory& history) {
  const std::vector<int32_t> ids = history.Landmarks();
  std::erase_if(from_utime_, [&](const auto& item) {
    return !std::binary_search(ids.begin(), ids.end(), item.first);
  });
}

}  // namespace pangea::vio

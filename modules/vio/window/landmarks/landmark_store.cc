#include "vio/window/landmarks/landmark_store.h"

#include <utility>

namespace pangea::vio {
namespace {

constexpr size_t kMinRays = 3;
constexpr double kMaxTriangulationRms = 3.0;  // sigmas

}  // namespace

std::vector<Landmark> LandmarkStore::Gather(const WindowState& state,
                                            const TrackHistory& history) const {
  std::vector<Landmark> landmarks;
  for (TrackHistory::Track& track : history.Tracks(state)) {
    const int32_t id = track.landmark_id;
    Landmark landmark;
    landmark.id = id;
    landmark.rays = std::move(track.rays);
    if (const auto from = from_utime_.find(id); from != from_utime_.end()) {
      std::erase_if(landmark.rays, [&](const FrameRay& ray) {
        return state.frames[ray.frame].utime <= from->second;
      });
    }
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
  std::erase_if(from_utime_, [&](const auto& item) { return !history.Sees(item.first); });
}

}  // namespace pangea::vio

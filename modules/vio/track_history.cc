#include "vio/track_history.h"

#include <algorithm>

namespace pangea::vio {

void TrackHistory::AddFrame(const TrackedFrame& frame, double ray_sigma) {
  auto& seen = frames_[frame.utime];
  for (const Observation& observation : frame.observations) {
    seen[observation.landmark_id] = {-1, observation.ray, ray_sigma * observation.sigma_px};
  }
}

std::vector<ClonedRay> TrackHistory::RaysOf(int32_t landmark_id, const WindowState& state,
                                            int64_t from_utime) const {
  std::vector<ClonedRay> rays;
  for (int i = 0; i < static_cast<int>(state.clones.size()); ++i) {
    const Clone& clone = state.clones[i];
    const auto frame = frames_.find(clone.utime);
    if (clone.is_edge_end || clone.utime < from_utime || frame == frames_.end()) {
      continue;
    }
    const auto seen = frame->second.find(landmark_id);
    if (seen != frame->second.end()) {
      rays.push_back({i, seen->second.ray, seen->second.sigma});
    }
  }
  return rays;
}

bool TrackHistory::Sees(int64_t utime, int32_t landmark_id) const {
  const auto frame = frames_.find(utime);
  return frame != frames_.end() && frame->second.contains(landmark_id);
}

const std::map<int32_t, ClonedRay>& TrackHistory::Frame(int64_t utime) const {
  static const std::map<int32_t, ClonedRay> kNothing;
  const auto frame = frames_.find(utime);
  return frame == frames_.end() ? kNothing : frame->second;
}

TrackHistory::Shift TrackHistory::ShiftBetween(int64_t from_utime, int64_t to_utime,
                                               const Eigen::Quaterniond& q_to_from) const {
  std::vector<double> shifts;
  const auto& to = Frame(to_utime);
  for (const auto& [id, ray] : Frame(from_utime)) {
    const auto other = to.find(id);
    if (other != to.end()) {
      const Eigen::Vector3d turned = q_to_from * Eigen::Vector3d(ray.ray.x(), ray.ray.y(), 1);
      if (turned.z() > 0.1) {
        shifts.push_back((turned.head<2>() / turned.z() - other->second.ray).norm());
      }
    }
  }
  if (shifts.empty()) {
    return {};
  }
  std::nth_element(shifts.begin(), shifts.begin() + shifts.size() / 2, shifts.end());
  return {shifts[shifts.size() / 2], shifts.size()};
}

}  // namespace pangea::vio

#include "vio/keyframes/track_history.h"

#include <Eigen/LU>
#include <limits>
#include <set>
#include <utility>

#include "core/median.h"

namespace pangea::vio {
namespace {

constexpr size_t kMinShared = 15;  // landmarks that tell whether an image stands still

// Another focal length or centre is as good as another pixel: (pixel - c) e + f d further in.
Eigen::Matrix<double, 2, 3> ByIntrinsics(const Observation& observation,
                                         const CameraModel& camera) {
  Eigen::Matrix<double, 2, 3> J_pixel;  // d(pixel)/d(ray, 1)
  const Eigen::Vector3d ray(observation.ray.x(), observation.ray.y(), 1);
  const auto pixel = camera.Project(ray, &J_pixel);
  if (!pixel) {
    return Eigen::Matrix<double, 2, 3>::Zero();
  }
  Eigen::Matrix<double, 2, 3> further;
  further << pixel->x() - camera.cx, camera.fx, 0, pixel->y() - camera.cy, 0, camera.fy;
  return -J_pixel.leftCols<2>().inverse() * further;
}

}  // namespace

void TrackHistory::AddFrame(const TrackedFrame& frame, const CameraModel& camera,
                            double ray_sigma) {
  auto& seen = frames_[frame.utime];
  const double row_s = camera.height > 1 ? camera.readout_s / (camera.height - 1) : 0;
  for (const Observation& observation : frame.observations) {
    seen[observation.landmark_id] = {-1, observation.ray, ray_sigma * observation.sigma_px,
                                     row_s * static_cast<double>(observation.pixel.y()),
                                     ByIntrinsics(observation, camera)};
  }
}

void TrackHistory::RemoveLandmark(int32_t landmark_id) {
  for (auto& [utime, seen] : frames_) {
    seen.erase(landmark_id);
  }
}

std::vector<int32_t> TrackHistory::Landmarks() const {
  std::set<int32_t> ids;
  for (const auto& [utime, seen] : frames_) {
    for (const auto& [id, ray] : seen) {
      ids.insert(id);
    }
  }
  return {ids.begin(), ids.end()};
}

std::vector<FrameRay> TrackHistory::RaysOf(int32_t landmark_id, const WindowState& state,
                                           int64_t from_utime) const {
  std::vector<FrameRay> rays;
  for (int i = 0; i <= state.Newest(); ++i) {
    const WindowFrame& in_window = state.frames[i];
    const auto frame = frames_.find(in_window.utime);
    if (in_window.pose_only || !in_window.is_tracked || in_window.utime < from_utime ||
        frame == frames_.end()) {
      continue;
    }
    const auto seen = frame->second.find(landmark_id);
    if (seen != frame->second.end()) {
      rays.push_back(seen->second);
      rays.back().frame = i;
    }
  }
  return rays;
}

bool TrackHistory::Sees(int64_t utime, int32_t landmark_id) const {
  const auto frame = frames_.find(utime);
  return frame != frames_.end() && frame->second.contains(landmark_id);
}

const std::map<int32_t, FrameRay>& TrackHistory::Frame(int64_t utime) const {
  static const std::map<int32_t, FrameRay> kNothing;
  const auto frame = frames_.find(utime);
  return frame == frames_.end() ? kNothing : frame->second;
}

size_t TrackHistory::Shared(int64_t a_utime, int64_t b_utime) const {
  const auto& seen = Frame(b_utime);
  size_t shared = 0;
  for (const auto& [id, ray] : Frame(a_utime)) {
    shared += seen.contains(id) ? 1 : 0;
  }
  return shared;
}

TrackHistory::Shift TrackHistory::ShiftBetween(int64_t from_utime, int64_t to_utime,
                                               const Eigen::Quaterniond& q_to_from) const {
  std::vector<double> shifts;
  const auto& to = Frame(to_utime);
  for (const auto& [id, ray] : Frame(from_utime)) {
    const auto other = to.find(id);
    if (other != to.end()) {
      const Eigen::Vector3d rotated = q_to_from * Eigen::Vector3d(ray.ray.x(), ray.ray.y(), 1);
      if (rotated.z() > 0.1) {
        shifts.push_back((rotated.head<2>() / rotated.z() - other->second.ray).norm());
      }
    }
  }
  if (shifts.empty()) {
    return {};
  }
  return {Median(shifts), shifts.size()};
}

double TrackHistory::MedianShiftSigmas(int64_t from_utime, int64_t to_utime) const {
  std::vector<double> shifts;
  const auto& to = Frame(to_utime);
  for (const auto& [id, ray] : Frame(from_utime)) {
    const auto other = to.find(id);
    if (other != to.end()) {
      shifts.push_back((ray.ray - other->second.ray).norm() / ray.sigma);
    }
  }
  if (shifts.size() < kMinShared) {
    return std::numeric_limits<double>::infinity();
  }
  return Median(std::move(shifts));
}

}  // namespace pangea::vio

#include "vio/keyframes/track_history.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <limits>

#include "core/median.h"
#include "vio/imu/stationary_options.h"

namespace pangea::vio {
namespace {

// An image counts as tracked if at least this many tracks, and this share of the earlier ones,
// continue in it. In the noise of a covered lens a tenth do.
constexpr size_t kMinTracks = 4;
constexpr double kMinTrackShare = 0.3;
constexpr size_t kMinShared = 15;  // landmarks needed for a shift in sigmas

// d(ray)/d(intrinsics): a change of the intrinsics acts like a change of the pixel by (pixel - c) e
// + f d + (change of the distortion), with the opposite sign.
Eigen::Matrix<double, 2, kIntrinsicsSize> ByIntrinsics(const Observation& observation,
                                                       const CameraModel& camera) {
  Eigen::Matrix<double, 2, 3> J_pixel;  // d(pixel)/d(ray, 1)
  const Eigen::Vector3d ray(observation.ray.x(), observation.ray.y(), 1);
  const auto pixel = camera.Project(ray, &J_pixel);
  if (!pixel) {
    return Eigen::Matrix<double, 2, kIntrinsicsSize>::Zero();
  }
  Eigen::Matrix<double, 2, kIntrinsicsSize> further;
  further.leftCols<3>() << pixel->x() - camera.cx, camera.fx, 0, pixel->y() - camera.cy, 0,
      camera.fy;
  further.rightCols<2>() = camera.DistortionJacobian(observation.ray);
  return -J_pixel.leftCols<2>().inverse() * further;
}

using SeenLandmarks = TrackHistory::SeenLandmarks;

bool HasSmallerId(const SeenLandmarks::value_type& a, const SeenLandmarks::value_type& b) {
  return a.first < b.first;
}

SeenLandmarks::const_iterator Find(const SeenLandmarks& seen, int32_t landmark_id) {
  const auto at = std::lower_bound(seen.begin(), seen.end(), landmark_id,
                                   [](const auto& one, int32_t id) { return one.first < id; });
  return at != seen.end() && at->first == landmark_id ? at : seen.end();
}

// Calls use(ray in a, ray in b) for each landmark in both.
template <typename Use>
void ForShared(const SeenLandmarks& a, const SeenLandmarks& b, const Use& use) {
  auto in_b = b.begin();
  for (const auto& [id, ray] : a) {
    while (in_b != b.end() && in_b->first < id) {
      ++in_b;
    }
    if (in_b != b.end() && in_b->first == id) {
      use(ray, in_b->second);
    }
  }
}

}  // namespace

void TrackHistory::AddFrame(const TrackedFrame& frame, const CameraModel& camera,
                            double ray_sigma) {
  SeenLandmarks& seen = frames_[frame.utime];
  seen.reserve(frame.observations.size());
  for (const Observation& observation : frame.observations) {
    seen.push_back({observation.landmark_id,
                    {-1, observation.ray, ray_sigma * observation.sigma_px,
                     camera.RowTime_s(static_cast<double>(observation.pixel.y())),
                     ByIntrinsics(observation, camera)}});
  }
  std::sort(seen.begin(), seen.end(), HasSmallerId);
}

void TrackHistory::RemoveLandmark(int32_t landmark_id) {
  for (auto& [utime, seen] : frames_) {
    const auto at = Find(seen, landmark_id);
    if (at != seen.end()) {
      seen.erase(at);
    }
  }
}

std::vector<TrackHistory::Track> TrackHistory::Tracks(const WindowState& state) const {
  struct Seen {
    int32_t landmark_id;
    int frame;
    const FrameRay* ray;
  };
  std::vector<Seen> all;
  for (int i = 0; i <= state.Newest(); ++i) {
    const WindowFrame& in_window = state.frames[i];
    if (!in_window.pose_only && in_window.is_tracked) {
      for (const auto& [id, ray] : Frame(in_window.utime)) {
        all.push_back({id, i, &ray});
      }
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Seen& a, const Seen& b) { return a.landmark_id < b.landmark_id; });
  std::vector<Track> tracks;
  for (const Seen& seen : all) {
    if (tracks.empty() || tracks.back().landmark_id != seen.landmark_id) {
      tracks.push_back({seen.landmark_id, {}});
    }
    std::vector<FrameRay>& rays = tracks.back().rays;
    rays.push_back(*seen.ray);
    rays.back().frame = seen.frame;
  }
  return tracks;
}

const SeenLandmarks& TrackHistory::Frame(int64_t utime) const {
  static const SeenLandmarks kNothing;
  const auto frame = frames_.find(utime);
  return frame == frames_.end() ? kNothing : frame->second;
}

bool TrackHistory::Sees(int32_t landmark_id) const {
  return std::any_of(frames_.begin(), frames_.end(), [landmark_id](const auto& frame) {
    return Find(frame.second, landmark_id) != frame.second.end();
  });
}

size_t TrackHistory::Shared(int64_t a_utime, int64_t b_utime) const {
  size_t shared = 0;
  ForShared(Frame(a_utime), Frame(b_utime), [&](const FrameRay&, const FrameRay&) { ++shared; });
  return shared;
}

bool TrackHistory::Continues(int64_t from_utime, int64_t to_utime) const {
  const size_t shared = Shared(from_utime, to_utime);
  const auto all = static_cast<double>(Frame(from_utime).size());
  return shared >= kMinTracks && static_cast<double>(shared) >= kMinTrackShare * all;
}

TrackHistory::Shift TrackHistory::ShiftBetween(int64_t from_utime, int64_t to_utime,
                                               const Eigen::Quaterniond& q_to_from) const {
  std::vector<double> shifts;
  ForShared(Frame(from_utime), Frame(to_utime), [&](const FrameRay& from, const FrameRay& to) {
    const Eigen::Vector3d rotated = q_to_from * from.ray.homogeneous();
    if (rotated.z() > 0.1) {
      shifts.push_back((rotated.hnormalized() - to.ray).norm());
    }
  });
  if (shifts.empty()) {
    return {};
  }
  return {Median(shifts), shifts.size()};
}

TrackHistory::ShiftSigmas TrackHistory::ShiftSigmasBetween(int64_t from_utime,
                                                           int64_t to_utime) const {
  std::vector<double> shifts;
  ForShared(Frame(from_utime), Frame(to_utime), [&](const FrameRay& from, const FrameRay& to) {
    shifts.push_back((from.ray - to.ray).norm() / from.sigma);
  });
  if (shifts.size() < kMinShared) {
    constexpr double kUnknown = std::numeric_limits<double>::infinity();
    return {kUnknown, kUnknown};
  }
  std::sort(shifts.begin(), shifts.end());
  const auto most = static_cast<size_t>(kMostTracks * static_cast<double>(shifts.size()));
  return {shifts[shifts.size() / 2], shifts[most]};
}

}  // namespace pangea::vio

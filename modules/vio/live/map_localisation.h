#pragma once

// The agent's pose in the fused map: the server's correction, refined with map landmarks that the
// agent's own keyframes see.
//
// Input: corrections, landmarks, the agent's published keyframes, and each new keyframe of the
// window as soon as it is described. Output: T_map_odom. Nothing is fed back to the odometry:
// published edges must be independent of the server's messages, or the server would count its own
// information twice. If there are no landmarks, too few are found, or they contradict the
// correction, T_map_odom is the correction's.
//
// In each keyframe, landmarks are searched by projection and descriptor. Memory is bounded:
// kMaxLandmarks landmarks, kMaxPublished odometry edges, the window's rays. No thread, no clock.

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "core/keyframe.h"
#include "core/map_landmarks.h"
#include "core/matching.h"
#include "core/server_messages.h"
#include "vio/live/window_localisation.h"

namespace pangea::vio {

struct MapLocalisationOptions {
  LocalizationOptions localization;
  // Search radius around a landmark's predicted position, pixels.
  double search_radius_px = 15;
  double pixel_sigma = 1.5;  // of a corner that matches a landmark, on octave 0
};

class MapLocalisation {
 public:
  static constexpr size_t kMaxLandmarks = 400;
  static constexpr size_t kMaxPublished = 200;

  explicit MapLocalisation(const MapLocalisationOptions& options = {}) : options_(options) {}

  // Call when the agent begins a new map: forgets everything but the counters.
  void Reset(const MapId& map);
  // False for a correction of another map, or with no newer revision; then nothing changes. If the
  // group's frame changes, all landmarks are forgotten.
  bool Correct(const Correction& correction);
  // False if the landmarks are for another map, or in another frame than the newest correction.
  bool Take(const MapLandmarks& landmarks);
  void NotePublished(const Keyframe& keyframe);
  bool HasLandmarks() const { return !known_.empty(); }
  size_t num_landmarks() const { return known_.size(); }
  // Call when the window's newest pose is a keyframe. `corners`: of that keyframe, with rolling
  // shutter compensated; their descriptors are of this kind.
  void AddKeyframe(const CameraModel& camera, const std::vector<Corner>& corners,
                   DescriptorKind kind, const WindowPoses& window);

  // Empty before the first correction.
  std::optional<Rigid3> T_map_odom() const;

  struct Counters {
    int64_t localised = 0;      // keyframes
    int64_t not_localised = 0;  // too few landmarks, or contradicting ones
    int64_t seen = 0;           // landmarks, in all keyframes
  };
  const Counters& counters() const { return counters_; }

 private:
  using LandmarkKey = std::pair<MapId, int32_t>;
  struct Known {
    KeyframeId source;
    Eigen::Vector3d p_source;  // position of the source's camera, in the map
    Eigen::Vector3d p_map;
    Eigen::Matrix3d covariance;
    Descriptor descriptor;
    int64_t arrival;
  };
  struct Match {
    LandmarkKey landmark;
    Eigen::Vector2d ray;
    double sigma;
  };
  struct Published {
    int32_t seq;
    int64_t utime;
    Rigid3 T_odom_body;
    std::optional<OdometryEdge> edge;
  };
  struct Seen {
    std::vector<Eigen::Vector3d> sources;
    std::vector<SeenLandmark> landmarks;
  };

  void ForgetOldest();
  std::optional<LocalizationPrior> PriorAt(const WindowPoses& window) const;
  std::vector<Match> FindIn(const CameraModel& camera, const std::vector<Corner>& corners,
                            const MatchingOptions& matching, const Rigid3& T_map_cam) const;
  Seen SeenIn(const WindowPoses& window) const;

  MapLocalisationOptions options_;
  MapId map_;
  std::optional<Correction> correction_;
  std::map<LandmarkKey, Known> known_;
  int64_t arrivals_ = 0;
  std::deque<Published> published_;
  std::map<int64_t, std::vector<Match>> matches_;  // by the keyframe's utime
  std::optional<LocalizationResult> localized_;
  Counters counters_;
};

}  // namespace pangea::vio

#include <cmath>
#include <cstring>

#include "messages/messages.h"
#include "messages/messages_checks.h"

namespace pangea {

using namespace messages_checks;

namespace {

constexpr int kMaxSources = 8;
constexpr int kMaxLandmarks = 64;
constexpr double kMaxSigma_m = 100;
constexpr double kMinDistance_m = 0.01;  // of a landmark from its source's camera
static_assert(sizeof(map_landmark_t::descriptor) == sizeof(Descriptor));

Eigen::Vector3d ToVector(const float* v) { return Eigen::Vector3f::Map(v).cast<double>(); }

bool IsSigma(double sigma) { return sigma > 0 && sigma <= kMaxSigma_m; }

}  // namespace

landmarks_t ToMessage(const MapLandmarks& landmarks) {
  landmarks_t m{};
  m.map = ToMessage(landmarks.map);
  m.group = ToMessage(landmarks.group);
  m.revision = landmarks.revision;
  for (const MapLandmarks::Source& source : landmarks.sources) {
    landmark_source_t s{};
    s.keyframe = ToMessage(source.keyframe);
    Eigen::Vector3f::Map(s.p_map_cam) = source.p_map_cam.cast<float>();
    m.sources.push_back(s);
  }
  m.num_sources = static_cast<int8_t>(m.sources.size());
  for (const MapLandmark& landmark : landmarks.landmarks) {
    map_landmark_t l{};
    l.source = static_cast<int8_t>(landmark.source);
    l.landmark_id = landmark.landmark_id;
    Eigen::Vector3f::Map(l.p_map) = landmark.p_map.cast<float>();
    l.sigma_along_m = static_cast<float>(landmark.sigma_along_m);
    l.sigma_across_m = static_cast<float>(landmark.sigma_across_m);
    std::memcpy(l.descriptor, landmark.descriptor.data(), sizeof(l.descriptor));
    m.landmarks.push_back(l);
  }
  m.num_landmarks = static_cast<int8_t>(m.landmarks.size());
  return m;
}

Parsed<MapLandmarks> Parse(const landmarks_t& m) {
  const auto map = Parse(m.map);
  const auto group = Parse(m.group);
  if (!map.value || !group.value || m.revision < 1) {
    return Refused<MapLandmarks>("landmarks: invalid maps or revision");
  }
  if (m.num_sources < 0 || m.num_sources > kMaxSources || m.num_landmarks < 0 ||
      m.num_landmarks > kMaxLandmarks) {
    return Refused<MapLandmarks>("landmarks: too many of them");
  }
  MapLandmarks landmarks{*map.value, *group.value, m.revision, {}, {}};
  for (const landmark_source_t& s : m.sources) {
    const auto keyframe = Parse(s.keyframe);
    const Eigen::Vector3d p_map_cam = ToVector(s.p_map_cam);
    if (!keyframe.value || !Bounded(p_map_cam, kMaxDistance)) {
      return Refused<MapLandmarks>("landmarks: invalid source");
    }
    landmarks.sources.push_back({*keyframe.value, p_map_cam});
  }
  for (const map_landmark_t& l : m.landmarks) {
    if (l.source < 0 || l.source >= m.num_sources || l.landmark_id < 0) {
      return Refused<MapLandmarks>("landmarks: invalid source index or id");
    }
    MapLandmark landmark{l.source,        l.landmark_id,    ToVector(l.p_map),
                         l.sigma_along_m, l.sigma_across_m, {}};
    const Eigen::Vector3d from_source = landmark.p_map - landmarks.sources[l.source].p_map_cam;
    if (!Bounded(landmark.p_map, kMaxDistance) || !(from_source.norm() > kMinDistance_m)) {
      return Refused<MapLandmarks>("landmarks: position out of range");
    }
    if (!IsSigma(landmark.sigma_along_m) || !IsSigma(landmark.sigma_across_m)) {
      return Refused<MapLandmarks>("landmarks: standard deviation out of range");
    }
    std::memcpy(landmark.descriptor.data(), l.descriptor, sizeof(l.descriptor));
    landmarks.landmarks.push_back(landmark);
  }
  return {std::move(landmarks), ""};
}

}  // namespace pangea

#include "map_points/map_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "map_points/track_point.h"

namespace pangea {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kAhead_s = 0.5;       // prediction time of the agent's motion
constexpr double kMaxDistance_m = 8;   // from the agent to a source
constexpr double kMaxAngle_rad = 0.4;  // between the two lines of sight to a landmark
constexpr double kMaxScale = 1.4;      // ratio of the two distances to it
constexpr int kOwnRecent = 15;         // newest keyframes of the agent's own map: not used
// A landmark is sent again after kRepeatAfter messages to the agent, or if it has moved by
// kMoved_m.
constexpr int kRepeatAfter = 20;
constexpr double kMoved_m = 0.005;
constexpr double kMinDepth = 0.3;     // m
constexpr double kBorder_px = 20;     // margin for the error of the predicted motion
constexpr double kMinSigma = 0.002;   // m, minimum of a published sigma
constexpr double kMaxAxes_rad = 1.2;  // between two cameras' axes
constexpr size_t kMinPoints = 8;      // in view, for a source to be used
constexpr size_t kMaxSources = 12;    // considered for one message
constexpr size_t kMaxNear = 500;      // keyframes looked at for one message; fewer than max_views
// Landmarks are spread over the image: at most kPerCell per cell.
constexpr int kColumns = 5, kRows = 4, kPerCell = 2;

}  // namespace

void MapPoints::Take(const MapState& state) { groups_.Take(PosedGroup(state)); }

void MapPoints::TakeRefined(const MapState& refined) {
  for (const KeyframePose& pose : refined.keyframes) {
    refined_.insert(pose.id);
  }
}

std::optional<MapPoints::Outlook> MapPoints::OutlookOf(const AgentPose& agent,
                                                       const PosedGroup& group) {
  auto newest = group.T_map_body.upper_bound({agent.map, std::numeric_limits<int32_t>::max()});
  if (newest == group.T_map_body.begin() || (--newest)->first.map != agent.map) {
    return std::nullopt;
  }
  const auto view = store_.Find(newest->first);
  if (view == nullptr) {
    return std::nullopt;
  }
  Rigid3 T_map_body = agent.T_map_body;
  T_map_body.t += kAhead_s * agent.v_map_body;
  const CameraModel& camera = view->keyframe().camera;
  return Outlook{camera, T_map_body * camera.T_body_cam, newest->first.seq,
                 view->keyframe().descriptor_kind};
}

// Selects the keyframe's points that the agent will see from a direction and distance similar to
// the keyframe's.
MapPoints::Source MapPoints::Look(const KeyframeView& view, const Rigid3& T_map_cam,
                                  const Outlook& outlook) const {
  const Keyframe& keyframe = view.keyframe();
  const Rigid3 T_cam_map = outlook.T_map_cam.Inverse();
  Source source{keyframe.id, T_map_cam, {}};
  for (const MapPoint& point : keyframe.points) {
    const auto p_keyframe = PointInCamera(keyframe, point);
    if (!p_keyframe || keyframe.corners[point.corner].landmark_id == kNoLandmark) {
      continue;
    }
    const Vector3d p_map = T_map_cam * *p_keyframe;
    const Vector3d p_cam = T_cam_map * p_map;
    const auto pixel = p_cam.z() > kMinDepth ? outlook.camera.Project(p_cam) : std::nullopt;
    const Vector3d now = p_map - outlook.T_map_cam.t, then = p_map - T_map_cam.t;
    const double scale = now.norm() / then.norm();
    if (pixel && outlook.camera.Contains(*pixel, kBorder_px) &&
        now.normalized().dot(then.normalized()) > std::cos(kMaxAngle_rad) && scale < kMaxScale &&
        scale > 1 / kMaxScale) {
      source.points.emplace_back(point.corner, *pixel);
    }
  }
  return source;
}

std::vector<KeyframeId> MapPoints::Near(const AgentPose& agent, const PosedGroup& group,
                                        const Outlook& outlook) {
  const Vector3d axis = outlook.T_map_cam.q * Vector3d::UnitZ();
  std::vector<std::pair<double, KeyframeId>> near;
  for (const auto& [id, T_map_body] : group.T_map_body) {
    const bool is_recent = id.map == agent.map && id.seq > outlook.newest_seq - kOwnRecent;
    const double distance_m = (T_map_body.t - outlook.T_map_cam.t).norm();
    if (is_recent || distance_m > kMaxDistance_m || !refined_.contains(id)) {
      continue;
    }
    const Vector3d* const axis_body = CameraAxisOf(id);
    if (axis_body != nullptr && axis.dot(T_map_body.q * *axis_body) >= std::cos(kMaxAxes_rad)) {
      near.emplace_back(distance_m, id);
    }
  }
  if (near.size() > kMaxNear) {
    std::ranges::nth_element(near, near.begin() + kMaxNear);
    near.resize(kMaxNear);
  }
  std::vector<KeyframeId> ids;
  for (const auto& [distance_m, id] : near) {
    ids.push_back(id);
  }
  std::ranges::sort(ids);
  return ids;
}

// One axis serves for a map: its extrinsics change by far less than kMaxAxes_rad.
const Vector3d* MapPoints::CameraAxisOf(const KeyframeId& id) {
  auto known = camera_axes_.find(id.map);
  if (known == camera_axes_.end()) {
    const auto view = store_.Find(id);
    if (view == nullptr) {
      return nullptr;
    }
    const Rigid3& T_body_cam = view->keyframe().camera.T_body_cam;
    known = camera_axes_.emplace(id.map, T_body_cam.q * Vector3d::UnitZ()).first;
  }
  return &known->second;
}

// Sorted by the number of points in view, largest first.
std::vector<MapPoints::Source> MapPoints::SourcesFor(const AgentPose& agent,
                                                     const PosedGroup& group,
                                                     const Outlook& outlook) {
  std::vector<Source> sources;
  for (const KeyframeId& id : Near(agent, group, outlook)) {
    const auto view = store_.Find(id);
    if (view == nullptr || view->keyframe().descriptor_kind != outlook.descriptor_kind) {
      continue;
    }
    const Rigid3 T_map_cam = group.T_map_body.at(id) * view->keyframe().camera.T_body_cam;
    Source source = Look(*view, T_map_cam, outlook);
    if (source.points.size() >= kMinPoints) {
      sources.push_back(std::move(source));
    }
  }
  std::stable_sort(sources.begin(), sources.end(), [](const Source& a, const Source& b) {
    return a.points.size() > b.points.size();
  });
  sources.resize(std::min(sources.size(), kMaxSources));
  return sources;
}

// Fills one message.
class MapPoints::Selection {
 public:
  Selection(const PosedGroup& group, const Outlook& outlook, KeyframeStore* store,
            SentPoints* sent_points)
      : group_(group), outlook_(outlook), store_(store), sent_points_(sent_points) {
    ++sent_points_->messages;
    std::erase_if(sent_points_->tracks, [&](const auto& track) {
      return track.second.message + kRepeatAfter < sent_points_->messages;
    });
  }

  void Add(const Source& source) {
    constexpr int kShare = (kMaxMessageLandmarks + kMaxMessageSources - 1) / kMaxMessageSources;
    const auto view = store_->Find(source.id);
    int taken = 0;
    for (const auto& [corner, pixel] : source.points) {
      if (taken == kShare || IsFull()) {
        return;
      }
      auto landmark = Landmark(*view, source, corner, pixel);
      if (!landmark) {
        continue;
      }
      if (taken++ == 0) {
        message_.sources.push_back({source.id, source.T_map_cam.t});
      }
      landmark->source = static_cast<int>(message_.sources.size()) - 1;
      message_.landmarks.push_back(*landmark);
    }
  }

  bool IsFull() const {
    return static_cast<int>(message_.landmarks.size()) >= kMaxMessageLandmarks;
  }
  bool HasAllSources() const {
    return static_cast<int>(message_.sources.size()) >= kMaxMessageSources;
  }
  MapLandmarks TakeMessage() { return std::move(message_); }

 private:
  std::optional<MapLandmark> Landmark(const KeyframeView& view, const Source& source, int corner,
                                      const Vector2d& pixel) {
    const Corner& seen = view.keyframe().corners[corner];
    const Track track{source.id.map, seen.landmark_id};
    int& in_cell = in_cell_[{static_cast<int>(pixel.x() * kColumns / outlook_.camera.width),
                             static_cast<int>(pixel.y() * kRows / outlook_.camera.height)}];
    if (in_cell >= kPerCell || taken_.contains(track)) {
      return std::nullopt;
    }
    const auto point = PointOfTrack(group_.T_map_body, view, corner, store_);
    const auto sent = sent_points_->tracks.find(track);
    if (!point || (sent != sent_points_->tracks.end() &&
                   (sent->second.p_map - point->p_map).norm() < kMoved_m)) {
      return std::nullopt;
    }
    ++in_cell;
    taken_.insert(track);
    sent_points_->tracks[track] = {sent_points_->messages, point->p_map};
    const Vector3d along = (point->p_map - source.T_map_cam.t).normalized();
    const double variance = along.dot(point->covariance * along);
    MapLandmark landmark;
    landmark.landmark_id = seen.landmark_id;
    landmark.p_map = point->p_map;
    landmark.sigma_along_m = std::max(kMinSigma, std::sqrt(variance));
    landmark.sigma_across_m =
        std::max(kMinSigma, std::sqrt(0.5 * std::max(0.0, point->covariance.trace() - variance)));
    landmark.descriptor = seen.descriptor;
    return landmark;
  }

  const PosedGroup& group_;
  const Outlook& outlook_;
  KeyframeStore* store_;
  SentPoints* sent_points_;
  MapLandmarks message_;
  std::set<Track> taken_;
  std::map<std::pair<int, int>, int> in_cell_;
};

std::optional<MapLandmarks> MapPoints::Choose(const AgentPose& agent) {
  const PosedGroup* const group = groups_.Find(agent.map);
  const auto outlook = group == nullptr ? std::nullopt : OutlookOf(agent, *group);
  if (!outlook) {
    return std::nullopt;
  }
  const std::vector<Source> sources = SourcesFor(agent, *group, *outlook);
  Selection selection(*group, *outlook, &store_, &sent_points_[agent.map]);
  for (const Source& source : sources) {
    if (selection.IsFull() || selection.HasAllSources()) {
      break;
    }
    selection.Add(source);
  }
  MapLandmarks message = selection.TakeMessage();
  if (message.landmarks.empty()) {
    return std::nullopt;
  }
  message.map = agent.map;
  message.group = group->id;
  message.revision = group->revision;
  return message;
}

}  // namespace pangea

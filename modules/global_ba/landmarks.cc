#include "global_ba/landmarks.h"

#include <algorithm>
#include <cmath>
#include <compare>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "core/numerics/triangulation.h"

namespace pangea {
namespace {

constexpr double kMinParallax = 0.02;  // radians, between two rays of the track
// An agent that stands still sees a landmark for hours. The equations of all keyframes that see it
// are dense, so a longer track is cut: each part is a landmark.
constexpr size_t kMaxOfTrack = 100;

// A part of a track of the odometry.
struct TrackId {
  MapId map;
  int32_t landmark_id = kNoLandmark;
  int part = 0;
  auto operator<=>(const TrackId&) const = default;
};

struct Track {
  std::vector<BaObservation> own;
  std::vector<BaObservation> matched;
};

class Builder {
 public:
  Builder(KeyframeStore* store, BaWorld* world) : world_(world) {
    for (const BaKeyframe& keyframe : world->keyframes) {
      T_map_cam_.push_back(keyframe.state.T_map_body * world->cameras[keyframe.camera].T_body_cam);
      seen_.push_back(See(store, keyframe.id));
    }
  }

  void AddTracks() {
    for (int i = 0; i < static_cast<int>(world_->keyframes.size()); ++i) {
      const std::vector<SeenCorner>& corners = seen_[i];
      for (int corner = 0; corner < static_cast<int>(corners.size()); ++corner) {
        const int32_t id = corners[corner].landmark_id;
        if (id == kNoLandmark || !corners[corner].has_ray) {
          continue;
        }
        const std::vector<BaObservation>& so_far = tracks_[TrackOf(i, corner)].own;
        // Of several corners of one landmark only the first is used.
        if (!so_far.empty() && so_far.back().keyframe == i) {
          continue;
        }
        if (so_far.size() == kMaxOfTrack) {
          cuts_[{MapOf(i), id}].push_back(i);
        }
        tracks_[TrackOf(i, corner)].own.push_back(Observe(i, corner, kTrackSigma_px));
      }
    }
  }

  void AddMatches(const MatchedKeyframes& match) {
    for (const auto& [corner_a, corner_b] : match.corners) {
      if (!Shows(match.a, corner_a) || !Shows(match.b, corner_b)) {
        continue;
      }
      const TrackId a = TrackOf(match.a, corner_a);
      const TrackId b = TrackOf(match.b, corner_b);
      const bool both = a.landmark_id != kNoLandmark && b.landmark_id != kNoLandmark;
      // However many keyframes match two tracks, this is a single match, right or wrong.
      if (both && (a == b || !met_.insert(std::minmax(a, b)).second)) {
        continue;
      }
      // Both landmarks are observed at each other's corner: the same measurement twice, so half
      // weight.
      const double share = both ? std::sqrt(0.5) : 1;
      AddMatch(a, match.b, corner_b, share);
      AddMatch(b, match.a, corner_a, share);
    }
  }

  void Finish() {
    for (const auto& [id, track] : tracks_) {
      const auto landmark = Triangulate(track.own);
      if (!landmark) {
        continue;
      }
      const int index = static_cast<int>(world_->landmarks.size());
      world_->landmarks.push_back(*landmark);
      for (const auto* observations : {&track.own, &track.matched}) {
        for (BaObservation seen : *observations) {
          if (Fits(seen, *landmark)) {
            seen.landmark = index;
            world_->observations.push_back(seen);
          }
        }
      }
    }
  }

 private:
  // What a landmark needs of a keyframe's corner. Matches name the keyframes in any order, so the
  // corners of all are kept: they are a quarter of a view.
  struct SeenCorner {
    int32_t landmark_id = kNoLandmark;
    bool has_ray = false;
    double match_sigma_px = 0;
    Eigen::Vector2f ray;
    Eigen::Matrix2f pixel_jacobian;
  };

  // Empty if the keyframe cannot be read.
  static std::vector<SeenCorner> See(KeyframeStore* store, const KeyframeId& id) {
    std::vector<SeenCorner> seen;
    if (const auto view = store->Find(id)) {
      for (const Corner& corner : view->keyframe().corners) {
        const auto index = static_cast<int>(seen.size());
        SeenCorner& here = seen.emplace_back();
        here.landmark_id = corner.landmark_id;
        here.has_ray = view->has_ray(index);
        if (here.has_ray) {
          here.match_sigma_px = CornerSigma(corner, kMatchSigma_px);
          here.ray = view->ray(index).cast<float>();
          here.pixel_jacobian = view->pixel_jacobian(index).cast<float>();
        }
      }
    }
    return seen;
  }

  const MapId& MapOf(int keyframe) const { return world_->keyframes[keyframe].id.map; }
  bool Shows(int keyframe, int corner) const {
    return corner < static_cast<int>(seen_[keyframe].size()) && seen_[keyframe][corner].has_ray;
  }

  TrackId TrackOf(int keyframe, int corner) const {
    TrackId track{MapOf(keyframe), seen_[keyframe][corner].landmark_id};
    if (const auto cuts = cuts_.find({track.map, track.landmark_id}); cuts != cuts_.end()) {
      const auto after = std::ranges::upper_bound(cuts->second, keyframe);
      track.part = static_cast<int>(after - cuts->second.begin());
    }
    return track;
  }

  BaObservation Observe(int keyframe, int corner, double sigma) const {
    const SeenCorner& seen = seen_[keyframe][corner];
    return {keyframe, -1, seen.ray.cast<double>(), seen.pixel_jacobian.cast<double>() / sigma};
  }

  void AddMatch(const TrackId& track, int keyframe, int corner, double share) {
    const auto known = tracks_.find(track);
    // If several keyframes of one track match the same corner, it is one measurement.
    if (track.landmark_id != kNoLandmark && known != tracks_.end() &&
        matched_.insert({track, keyframe, corner}).second) {
      const double sigma = seen_[keyframe][corner].match_sigma_px;
      known->second.matched.push_back(Observe(keyframe, corner, sigma / share));
    }
  }

  // The point nearest to all rays; empty if they are too parallel or do not fit.
  std::optional<Eigen::Vector3d> Triangulate(const std::vector<BaObservation>& seen) const {
    std::vector<LineOfSight> lines;
    double least_cosine = 1;
    for (const BaObservation& s : seen) {
      const Rigid3& T_map_cam = T_map_cam_[s.keyframe];
      lines.push_back({T_map_cam.t, T_map_cam.q * s.ray.homogeneous().normalized()});
      least_cosine = std::min(least_cosine, lines.front().direction.dot(lines.back().direction));
    }
    if (least_cosine > std::cos(kMinParallax)) {
      return std::nullopt;
    }
    const auto point = TriangulateMidpoint(lines);
    const bool fits = point && std::all_of(seen.begin(), seen.end(),
                                           [&](const BaObservation& s) { return Fits(s, *point); });
    return fits ? point : std::nullopt;
  }

  bool Fits(const BaObservation& seen, const Eigen::Vector3d& point) const {
    constexpr double kMinDepth_m = 0.1;
    const Eigen::Vector3d p_cam = T_map_cam_[seen.keyframe].Inverse() * point;
    return p_cam.z() > kMinDepth_m &&
           (seen.sqrt_info * (p_cam.hnormalized() - seen.ray)).norm() < kMaxStartSigmas;
  }

  BaWorld* world_;
  std::vector<Rigid3> T_map_cam_;              // by keyframe
  std::vector<std::vector<SeenCorner>> seen_;  // by keyframe
  std::map<TrackId, Track> tracks_;
  // By map and landmark_id, of long tracks: the keyframes at which new parts begin, ascending.
  std::map<std::pair<MapId, int32_t>, std::vector<int>> cuts_;
  std::set<std::pair<TrackId, TrackId>> met_;
  std::set<std::tuple<TrackId, int, int>> matched_;  // (track, keyframe, corner)
};

}  // namespace

void AddLandmarks(const std::vector<MatchedKeyframes>& matches, KeyframeStore* store,
                  BaWorld* world) {
  Builder builder(store, world);
  builder.AddTracks();
  for (const MatchedKeyframes& match : matches) {
    builder.AddMatches(match);
  }
  builder.Finish();
}

}  // namespace pangea

#include "global_ba/group_world.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "global_ba/landmarks.h"
#include "global_ba/redundancy.h"

namespace pangea {
namespace {

BaKeyframe Start(const Keyframe& keyframe, const Rigid3& T_map_body) {
  BaKeyframe start;
  start.id = keyframe.id;
  start.utime = keyframe.utime;
  const Eigen::Quaterniond q_map_odom = T_map_body.q * keyframe.T_odom_body.q.conjugate();
  start.state = {T_map_body, q_map_odom * keyframe.v_odom_body, keyframe.gyro_bias,
                 keyframe.accel_bias};
  return start;
}

// No odometry is more accurate, whatever it says: such an edge would outweigh the rounding of all
// else.
Matrix6d Believable(Matrix6d covariance) {
  constexpr double kMinSigma = 1e-5;  // m, rad
  covariance.diagonal() = covariance.diagonal().cwiseMax(kMinSigma * kMinSigma);
  return covariance;
}

void SetUnknownScales(const std::vector<std::vector<double>>& sigmas_of_maps, BaWorld* world) {
  std::vector<double> unknown;
  for (const std::vector<double>& sigmas : sigmas_of_maps) {
    unknown.push_back(UnknownScaleSigma(sigmas));
  }
  for (BaKeyframe& keyframe : world->keyframes) {
    keyframe.unknown_scale = unknown[keyframe.camera];
  }
}

// Number of keys in a sorted container that belong to the map.
template <typename Keyframes>
auto NumOfMap(const Keyframes& keyframes, const MapId& map) {
  constexpr int32_t kLast = std::numeric_limits<int32_t>::max();
  return std::distance(keyframes.lower_bound({map, 0}), keyframes.upper_bound({map, kLast}));
}

// Builds a world in steps: keyframes, then which are fixed, then landmarks.
class Maker {
 public:
  explicit Maker(KeyframeStore* store) : store_(store) {}

  // Call in ascending order of ids.
  void Add(const KeyframeId& id, const Rigid3& T_map_body) {
    const auto view = store_->Find(id);
    if (view == nullptr) {
      return;
    }
    const Keyframe& keyframe = view->keyframe();
    BaKeyframe start = Start(keyframe, T_map_body);
    // One camera per map, with the extrinsics of its last keyframe.
    const bool same_map = !world_.keyframes.empty() && world_.keyframes.back().id.map == id.map;
    world_.cameras.resize(world_.cameras.size() + (same_map ? 0 : 1));
    world_.cameras.back() = {.T_body_cam = keyframe.camera.T_body_cam};
    start.camera = static_cast<int>(world_.cameras.size()) - 1;
    scale_sigmas_.resize(world_.cameras.size());
    scale_sigmas_.back().push_back(keyframe.scale_sigma);
    if (keyframe.edge) {
      const auto previous = index_.find({id.map, keyframe.edge->from_seq});
      if (previous != index_.end()) {
        start.previous = previous->second;
        start.preintegration = keyframe.preintegration;
        start.edge = {keyframe.edge->T_from_this, Believable(keyframe.edge->covariance)};
      }
    }
    index_[id] = static_cast<int>(world_.keyframes.size());
    world_.keyframes.push_back(std::move(start));
    cull_.push_back(Cull::kIfRedundant);
  }

  // Starts from the previous adjustment; fixed keyframes that it left out are left out again.
  void StartFrom(const AdjustedGroup& adjusted, const MapPoses& state, const LocalPart& part) {
    for (size_t i = 0; i < world_.keyframes.size(); ++i) {
      BaKeyframe& keyframe = world_.keyframes[i];
      keyframe.fixed = !part.moving.contains(keyframe.id);
      if (const KeyframeState* known = adjusted.Find(keyframe.id)) {
        keyframe.state = MovedTo(keyframe.state.T_map_body, *known);
        cull_[i] = Cull::kNever;
      } else if (keyframe.fixed) {
        cull_[i] = Cull::kAlways;
      }
    }
    FixCameras(adjusted, state, part);
  }

  BaWorld Finish(const std::vector<MatchedPair>& pairs) {
    SetUnknownScales(scale_sigmas_, &world_);
    std::vector<MatchedKeyframes> matches;
    for (const MatchedPair& pair : pairs) {
      const auto query = index_.find(pair.query);
      const auto match = index_.find(pair.match);
      if (query != index_.end() && match != index_.end()) {
        matches.push_back({query->second, match->second, pair.corners});
        NeedEnds(query->second, match->second);
      }
    }
    AddLandmarks(matches, store_, &world_);
    return WithoutRedundant(world_, cull_);
  }

 private:
  void NeedEnds(int query, int match) {
    for (const int end : {query, match}) {
      cull_[end] = cull_[end] == Cull::kAlways ? Cull::kAlways : Cull::kNever;
    }
  }

  void FixCameras(const AdjustedGroup& adjusted, const MapPoses& state, const LocalPart& part) {
    for (const BaKeyframe& keyframe : world_.keyframes) {
      const MapId& map = keyframe.id.map;
      const auto known = adjusted.cameras.find(map);
      BaCamera& camera = world_.cameras[keyframe.camera];
      if (known != adjusted.cameras.end() && !camera.fixed &&
          2 * NumOfMap(part.moving, map) < NumOfMap(state, map)) {
        camera = known->second;
        camera.fixed = true;
      }
    }
  }

  KeyframeStore* store_;
  BaWorld world_;
  std::vector<std::vector<double>> scale_sigmas_;  // by camera
  std::vector<Cull> cull_;                         // by keyframe
  std::map<KeyframeId, int> index_;
};

// Removes the observations of landmarks that no moving keyframe sees: they have no effect.
void DropWhatIsFixed(BaWorld* world) {
  std::vector<bool> moves(world->landmarks.size(), false);
  for (const BaObservation& seen : world->observations) {
    moves[seen.landmark] = moves[seen.landmark] || !world->keyframes[seen.keyframe].fixed;
  }
  std::erase_if(world->observations,
                [&](const BaObservation& seen) { return !moves[seen.landmark]; });
  DropUnderobservedLandmarks(world);
}

}  // namespace

BaWorld MakeGroupWorld(const MapPoses& state, const std::vector<MatchedPair>& pairs,
                       KeyframeStore* store) {
  Maker maker(store);
  for (const auto& [id, T_map_body] : state) {
    maker.Add(id, T_map_body);
  }
  return maker.Finish(pairs);
}

BaWorld MakeLocalWorld(const MapPoses& state, const LocalPart& part, const AdjustedGroup& adjusted,
                       const std::vector<MatchedPair>& pairs, KeyframeStore* store) {
  Maker maker(store);
  std::set<KeyframeId> all = part.fixed;
  all.insert(part.moving.begin(), part.moving.end());
  for (const KeyframeId& id : all) {
    maker.Add(id, state.at(id));
  }
  maker.StartFrom(adjusted, state, part);
  BaWorld world = maker.Finish(pairs);
  DropWhatIsFixed(&world);
  return world;
}

}  // namespace pangea

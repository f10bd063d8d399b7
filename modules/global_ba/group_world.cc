#include "global_ba/group_world.h"

#include <algorithm>
#include <map>
#include <memory>

namespace pangea {
namespace {

BaKeyframe Start(const Keyframe& keyframe, const Rigid3& T_map_body) {
  BaKeyframe start;
  start.id = keyframe.id;
  start.utime = keyframe.utime;
  const Eigen::Quaterniond q_map_odom = T_map_body.q * keyframe.T_odom_body.q.conjugate();
  start.imu = {T_map_body, q_map_odom * keyframe.v_odom_body, keyframe.gyro_bias,
               keyframe.accel_bias};
  return start;
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

}  // namespace

BaWorld MakeGroupWorld(const MapState& state, const std::vector<MatchedPlaces>& places,
                       const GroupWorldOptions& options, SubmapStore* store) {
  std::map<KeyframeId, Rigid3> poses;
  for (const KeyframePose& pose : state.keyframes) {
    poses[pose.id] = pose.T_map_body;
  }
  BaWorld world;
  std::vector<std::vector<double>> scale_sigmas;  // by camera
  std::map<KeyframeId, int> index;
  for (const auto& [id, T_map_body] : poses) {
    const auto view = store->Find(id);
    if (view == nullptr) {
      continue;
    }
    const Keyframe& keyframe = view->keyframe();
    BaKeyframe start = Start(keyframe, T_map_body);
    // A camera for each map, as the last keyframe has it.
    const bool same_map = !world.keyframes.empty() && world.keyframes.back().id.map == id.map;
    world.T_body_cam.resize(world.T_body_cam.size() + (same_map ? 0 : 1));
    world.T_body_cam.back() = keyframe.camera.T_body_cam;
    start.camera = static_cast<int>(world.T_body_cam.size()) - 1;
    scale_sigmas.resize(world.T_body_cam.size());
    scale_sigmas.back().push_back(keyframe.scale_sigma);
    if (keyframe.edge && keyframe.preintegration) {
      const auto previous = index.find({id.map, keyframe.edge->from_seq});
      if (previous != index.end()) {
        start.previous = previous->second;
        start.preintegration = keyframe.preintegration;
        start.edge = {keyframe.edge->T_from_this, keyframe.edge->covariance};
      }
    }
    index[id] = static_cast<int>(world.keyframes.size());
    world.keyframes.push_back(std::move(start));
  }
  SetUnknownScales(scale_sigmas, &world);
  std::vector<MatchedKeyframes> matches;
  std::vector<bool> needed(world.keyframes.size(), false);
  for (const MatchedPlaces& place : places) {
    const auto query = index.find(place.query);
    const auto match = index.find(place.match);
    if (query != index.end() && match != index.end()) {
      matches.push_back({query->second, match->second, place.corners});
      needed[query->second] = needed[match->second] = true;
    }
  }
  AddLandmarks(matches, options.landmarks, store, &world);
  return WithoutRedundant(world, needed, options.redundancy);
}

}  // namespace pangea

#pragma once

// The cores of the server's processes in one process, each measured by itself.

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/scale_city/city.h"
#include "bench/use_by_process.h"
#include "core/group_states.h"
#include "fusion/fusion.h"
#include "global_ba/global_ba.h"
#include "inter_map_ba/inter_map_ba.h"
#include "map_points/map_points.h"
#include "place_recognition/place_recognition.h"
#include "posegraph/posegraph.h"

namespace pangea::bench {

class Cores {
 public:
  // `recognition_alone`: the others get nothing.
  Cores(bool recognition_alone, const GlobalBaOptions& global_ba);

  // As from a journal.
  void Remember(const Step& step);
  // Every group is solved, and its keyframes count as adjusted: the city has been there for long.
  // `adjust`: they are.
  void Start(bool adjust);

  // The keyframe as it comes from an agent, and the results of its candidates.
  std::vector<Constraint> Take(const Keyframe& keyframe);
  // What follows when nothing more comes: all is solved anew and the groups that changed since
  // Start are adjusted.
  void Quiet();

  // The newest state of the map's group; null before there is any.
  const MapState* StateOf(const MapId& map) const { return states_.Find(map); }
  std::map<std::string, Use> TakeUse() { return use_.Take(); }
  // CPU of the pose graph's longest work on a keyframe since it was last asked.
  double TakeLongestSolve_ms() { return std::exchange(longest_solve_ms_, 0); }

 private:
  Constraint Verify(const KeyframeId& query, const PlaceCandidate& candidate);
  void AdjustDue();
  void Tell(const PoseGraphUpdate& update);
  void SendPoints(const Keyframe& keyframe);

  bool recognition_alone_;
  UseByProcess use_;
  std::unique_ptr<PlaceRecognition> recognition_;
  std::unique_ptr<InterMapBa> inter_map_ba_;
  std::unique_ptr<Fusion> fusion_;
  std::unique_ptr<PoseGraph> graph_;
  std::unique_ptr<GlobalBa> global_ba_;
  std::unique_ptr<MapPoints> map_points_;
  GroupStates<MapState> states_;
  std::map<MapId, Rigid3> T_map_odom_;
  bool started_ = false;
  double longest_solve_ms_ = 0;
};

}  // namespace pangea::bench

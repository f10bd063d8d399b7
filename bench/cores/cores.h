#pragma once

// The cores of the server's processes in one process, each measured separately.

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bench/cores/step.h"
#include "bench/process_use.h"
#include "core/group_states.h"
#include "global_ba/global_ba.h"
#include "loop_verification/loop_verifier.h"
#include "map_points/map_points.h"
#include "place_recognition/place_recognition.h"
#include "posegraph/posegraph.h"

namespace pangea::bench {

class Cores {
 public:
  // `recognition_alone`: the other cores get no input.
  Cores(bool recognition_alone, const GlobalBaOptions& global_ba);

  // Adds a keyframe with its results, as from a journal.
  void Remember(const Step& step);
  // Solves every group, and marks its keyframes as adjusted, as on a server that has run for long.
  // `adjust`: adjusts them really.
  void Start(bool adjust);

  // Processes a keyframe from an agent; returns it with its match and results.
  Step Take(const Keyframe& keyframe);
  // The work when no more messages come: solves everything anew, and adjusts the groups that have
  // changed since Start.
  void Quiet();

  // The newest state of the map's group; null if there is none yet.
  const MapState* StateOf(const MapId& map) const { return states_.Find(map); }
  std::vector<MapState> States() const { return graph_->States(); }
  std::map<std::string, Use> TakeUse() { return use_.Take(); }
  // CPU time of the pose graph's longest work on a keyframe since the last call.
  double TakeLongestSolve_ms() { return std::exchange(longest_solve_ms_, 0); }

 private:
  Constraint Verify(const KeyframeId& query, const PlaceCandidate& candidate);
  void AdjustDue();
  void Tell(const PoseGraphUpdate& update);
  void SendPoints(const Keyframe& keyframe);

  bool recognition_alone_;
  UseByProcess use_;
  std::unique_ptr<PlaceRecognition> recognition_;
  std::unique_ptr<LoopVerifier> inter_map_ba_;
  std::unique_ptr<LoopVerifier> fusion_;
  std::unique_ptr<PoseGraph> graph_;
  std::unique_ptr<GlobalBa> global_ba_;
  std::unique_ptr<MapPoints> map_points_;
  GroupStates<MapState> states_;
  std::map<MapId, Rigid3> T_map_odom_;
  bool started_ = false;
  double longest_solve_ms_ = 0;
};

}  // namespace pangea::bench

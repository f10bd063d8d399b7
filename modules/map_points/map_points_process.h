#pragma once

// In: KEYFRAME_*, MAP_STATE, REFINEMENT, POSE_*, HAVE. Out: LANDMARKS_k, STATUS_map_points.
//
// A process that starts late asks for the states of older maps; the answer includes refinements.
// At most two messages per second, of up to 1200 bytes each, to each agent in a group: 2.4 kB/s.
// Best effort: a lost landmark is sent again later if the agent still looks there.

#include <cstdint>
#include <map>
#include <memory>

#include "bus/node.h"
#include "bus/process.h"
#include "journal_follower/journal_follower.h"
#include "map_points/map_points.h"
#include "messages/state_chunks.h"
#include "pangea/map_state_t.hpp"
#include "pangea/pose_t.hpp"

namespace pangea {

class MapPointsProcess : public Process {
 public:
  static constexpr int64_t kInterval_us = 500'000;  // between two messages to one agent

  // `records`: stores keyframes (core/keyframe_store.h).
  explicit MapPointsProcess(Bus& bus, const std::shared_ptr<RecordStore>& records = nullptr,
                            const CheckpointPlace& checkpoint = {});

  void Tick(int64_t now_utime) override;

 private:
  void OnMapState(MapState state, const map_state_t& message);
  void OnRefinement(MapState state, const map_state_t& message);
  void OnPose(const pose_t& message);
  void PublishStatus(int64_t now_utime);

  Node node_;
  std::shared_ptr<JournalRecords> records_;
  MapPoints points_;
  JournalFollower journal_;
  StateChunks states_;
  StateChunks refinements_;
  std::map<int32_t, int64_t> sent_utime_;  // by agent: utime of the pose at its last message
};

}  // namespace pangea

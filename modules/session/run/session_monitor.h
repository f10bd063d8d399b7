#pragma once

// Monitors a running session: listens on the server bus and the agents' buses, and provides the
// progress of each agent, which agents are fused, and whether the server has finished all its work.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "core/drift.h"
#include "core/group_states.h"
#include "pangea/map_id_t.hpp"
#include "pangea/rigid3_t.hpp"
#include "pangea/status_t.hpp"
#include "session/processes/buses.h"

namespace pangea::session {

struct AgentProgress {
  // Stamp of its first image, sensor clock; 0 if there is none yet. For stored keyframes: of the
  // first keyframe.
  int64_t first_utime = 0;
  int64_t newest_utime = 0;  // of its newest image
  bool tracking = false;
  std::string reason;  // why it is not tracking
  int64_t keyframes = 0;
  std::vector<int32_t> fused_with;  // other agents in its group
  // By how much corrections have moved the agent's newest keyframe since its map joined its group,
  // metres.
  double drift_m = 0;

  double recorded_s() const { return 1e-6 * static_cast<double>(newest_utime - first_utime); }
};

class SessionMonitor {
 public:
  explicit SessionMonitor(const Buses& buses);
  ~SessionMonitor();

  // Handles the waiting messages of all buses; waits at most `timeout_ms`.
  void Handle(int timeout_ms);

  const AgentProgress& agent(int32_t id) const;
  // The agent's bus, which Handle handles.
  Bus& agent_bus(int32_t id) { return *agent_buses_.at(id); }
  // Newest status of each process, by name, from any bus.
  const std::map<std::string, status_t>& statuses() const { return statuses_; }
  // Number of the agent's keyframes on its bus that the server has not acknowledged.
  int64_t Unacknowledged(int32_t id) const;
  // The agent's player was killed and starts again: what it had published does not count.
  void ForgetPublished(int32_t id);
  // CPU time of each process, over all its starts.
  std::map<std::string, double> CpuSeconds() const;
  int constraints_accepted() const { return accepted_; }
  int constraints_refused() const { return refused_; }
  int num_results() const { return accepted_ + refused_; }

  // Whether each of these processes has reported at all.
  bool HaveReported(const std::vector<std::string>& processes) const;
  // Whether each of these processes has reported within the last 3 s that nothing is pending, and
  // the server bus has carried no message of work for `quiet_s`.
  bool Idle(const std::vector<std::string>& processes, double quiet_s) const;
  // Time since the last message of work on the server bus, seconds.
  double QuietSeconds() const;

 private:
  void WatchServer(Bus& bus);
  void WatchAgent(int32_t id, Bus& bus);
  void OnMapState(Bytes data);
  void OnCorrection(int32_t agent_id, Bytes data);
  void OnPose(int32_t agent_id, Bytes data);
  void OnKeyframe(int32_t agent_id, Bytes data);
  void OnHave(Bytes data);
  void NotePose(int32_t agent_id, const map_id_t& map, const rigid3_t& T_odom_body);
  void OnStatus(Bytes data);

  std::vector<std::unique_ptr<LcmBus>> buses_;
  std::map<int32_t, Bus*> agent_buses_;
  std::map<int32_t, AgentProgress> agents_;
  struct NewestPose {
    MapId map;
    Rigid3 T_odom_body;
  };
  std::map<int32_t, NewestPose> poses_;  // by agent
  std::set<int32_t> with_odometry_;      // agents that publish poses
  std::map<MapId, Drift> drifts_;
  std::map<MapId, int32_t> published_, acknowledged_;  // number of keyframes
  GroupStates<GroupMaps> groups_;
  std::map<std::string, status_t> statuses_;
  std::map<std::string, int64_t> status_received_;  // wall clock
  std::map<std::string, double> cpu_before_s_;      // of starts before the last one
  int64_t last_work_ = 0;                           // wall clock
  int accepted_ = 0;
  int refused_ = 0;
};

}  // namespace pangea::session

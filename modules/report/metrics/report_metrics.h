#pragma once

// The metrics of a report, from captured logs and the recordings' ground truth.

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "eval/metrics.h"
#include "report/metrics/report_anchors.h"
#include "report/metrics/report_groups.h"
#include "report/metrics/report_live.h"
#include "report/metrics/report_truth.h"
#include "report/report.h"
#include "report/report_log.h"

namespace pangea {

struct AgentMetrics {
  int32_t id = 0;
  std::vector<MapId> maps;               // also those of earlier sessions
  std::set<MapId> recording_maps;        // those made from its recording (recording_maps.h)
  size_t keyframes = 0;                  // of all its maps
  size_t group = 0;                      // its main group: index into ReportMetrics::groups
  MapId main_map;                        // the map with most keyframes in that group
  std::set<MapId> trajectory_maps;       // of its trajectory: its recording's in that group
  std::map<MapId, Trajectory> odometry;  // T_odom_body; at camera rate if odometry_at_camera_rate
  bool odometry_at_camera_rate = false;
  Trajectory ground_truth;              // of the part that was played; empty for none
  std::optional<double> initialised_s;  // from the first image played to the first pose
  double path_m = 0;                    // length of the odometry's track, its recording's maps
  std::optional<Ate> vio;               // odometry of the main map, SE(3)
  std::optional<Ate> server;            // its recording's keyframes in the main group, SE(3)
  std::optional<double> coverage;
  LiveMetrics live;        // of the poses that it showed during the session
  AnchorTrack anchors;     // on its bus
  ProcessSamples samples;  // of the processes on its bus
  AgentRun run;

  // Whether the ATE is meaningful: coverage >= 0.95 and a single map of the recording.
  bool AteCounts() const;
};

struct GroupMetrics {
  FinalGroup group;
  std::optional<JointAte> joint;      // one SE(3) alignment for all its agents
  std::vector<int32_t> joint_agents;  // those with ground truth, in the order of joint->agents
};

struct ReportMetrics {
  std::vector<AgentMetrics> agents;  // ascending id
  std::vector<GroupMetrics> groups;  // in the order of FinalGroups
  ConstraintsTruth all_constraints;
  ConstraintsTruth inter_constraints;
  ConstraintsTruth intra_constraints;
  std::vector<AnchorMetrics> anchors;
  std::vector<std::string> notes;
  std::vector<std::string> lost;  // damage of the logs, lines of LossLines

  // Index of the agent in `agents`, which determines its colour.
  size_t IndexOf(int32_t agent_id) const;
};

// Damaged parts of the agents' logs are added to `readings` (log_reader.h); ReportMetrics::lost
// describes everything in it.
ReportMetrics ComputeMetrics(const ReportInput& input, const CapturedSession& session,
                             LogReadings* readings = nullptr);

}  // namespace pangea

#pragma once

// Reads the parts of a session's logs that a report needs.

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/anchor.h"
#include "core/camera_model.h"
#include "core/ids.h"
#include "core/server_messages.h"
#include "log_file/log_reading.h"
#include "pangea/status_t.hpp"
#include "recording/trajectory.h"
#include "report/anchor_track.h"

namespace pangea {

struct CapturedPoint {
  Eigen::Vector3d p_body;
  int32_t landmark_id = 0;    // kNoLandmark for none
  double relative_sigma = 0;  // of the depth
};

struct CapturedKeyframe {
  int64_t utime = 0;
  Rigid3 T_odom_body;
  std::vector<CapturedPoint> points;
  double session_s = 0;  // capture time, since the log's first event
};

// The pose that an agent showed at one image.
struct LivePose {
  int64_t utime = 0;
  MapId map;    // its odom frame
  MapId frame;  // the map whose odom frame T_map_body is in
  int64_t revision = 0;
  Rigid3 T_odom_body;
  Rigid3 T_map_body;
};

// Values from a process' status, once a second.
struct ProcessSample {
  int64_t utime = 0;                            // capture time, wall clock
  double cpu_s = 0;                             // since the process' start
  std::optional<int64_t> bytes_up, bytes_down;  // on the link; only an uplink's
};
using ProcessSamples = std::map<std::string, std::vector<ProcessSample>>;  // by process

// POSE_k and CORRECTION_k of one agent, its anchors, and the status of its processes.
struct PoseTrack {
  std::optional<int64_t> first_utime;  // first pose message, whatever its state
  std::optional<int64_t> first_tracking_utime;
  int64_t images = 0;                    // pose messages from the first one that tracks
  int64_t poses = 0;                     // those of them that track
  int64_t images_dropped = 0;            // by an odometry that was too slow: without a pose message
  std::set<MapId> maps;                  // of its poses and keyframes
  std::map<MapId, Trajectory> odometry;  // T_odom_body while tracking
  std::vector<LivePose> live;            // while tracking, ascending in time
  AnchorTrack anchors;
  ProcessSamples samples;
};

// A change of groups, in the order of the log.
struct GroupChange {
  bool fused = true;                      // false: a group was split
  double session_s = 0;                   // since the log's first event
  int64_t revision = 0;                   // of the state with the change
  MapId frame;                            // the map whose odom frame is the group's
  std::vector<MapId> maps;                // the group after it
  std::map<MapId, int64_t> newest_utime;  // by map: of its keyframes in the group
};

// Messages that did not decode, or whose values are refused.
struct RefusedMessages {
  int count = 0;
  std::string first_reason;
};

struct CapturedSession {
  int64_t begin_utime = 0;  // the log's first event, wall clock
  std::map<KeyframeId, CapturedKeyframe> keyframes;
  // by map: the newest complete state that mentions it; maps of one group share the object
  std::map<MapId, std::shared_ptr<const MapState>> states;
  std::vector<GroupChange> changes;
  std::map<int64_t, Constraint> constraints;  // by id
  // by anchor, in any order; of the same revision and editor only the first
  std::map<AnchorId, std::vector<AnchorEdit>> anchor_edits;
  std::set<AnchorId> anchors_placed;         // whose place the server has published
  std::map<int32_t, CameraModel> cameras;    // by agent, of the newest keyframe
  std::map<std::string, status_t> statuses;  // newest of each process
  ProcessSamples samples;
  std::map<int32_t, PoseTrack> poses;
  std::map<std::string, RefusedMessages> refused;  // by channel
  int incomplete_states = 0;                       // with a missing chunk
};

// Reads KEYFRAME_*, CONSTRAINT, MAP_STATE, ANCHOR_EDIT, STATUS_* of a server bus' log. Damaged
// parts of the log are reported in `readings` (log_reader.h), here and below.
CapturedSession ReadServerLog(const std::string& path, LogReadings* readings = nullptr);
// Reads POSE_<agent_id>, KEYFRAME_<agent_id>, CORRECTION_<agent_id>, STATUS_* and the messages for
// AnchorTrack of an agent bus' log.
PoseTrack ReadPoses(const std::string& path, int32_t agent_id, LogReadings* readings = nullptr);

}  // namespace pangea

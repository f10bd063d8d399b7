#include "report/report_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bus/node.h"
#include "core/group_states.h"
#include "core/keyframe.h"
#include "log_file/log_reader.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "messages/state_chunks.h"
#include "pangea/correction_t.hpp"
#include "pangea/pose_t.hpp"

namespace pangea {
namespace {

CapturedKeyframe Captured(const Keyframe& keyframe, double session_s) {
  CapturedKeyframe captured{keyframe.utime, keyframe.T_odom_body, {}, session_s};
  for (const MapPoint& point : keyframe.points) {
    if (const auto p_cam = PointInCamera(keyframe, point)) {
      captured.points.push_back(
          {keyframe.camera.T_body_cam * *p_cam,
           keyframe.corners[static_cast<size_t>(point.corner)].landmark_id,
           std::sqrt(static_cast<double>(point.inverse_depth_var)) / point.inverse_depth});
    }
  }
  return captured;
}

// Assembles the chunks of MAP_STATE; keeps the newest states and the changes of groups.
class States {
 public:
  explicit States(CapturedSession* session) : session_(session) {}

  void AddChunk(const map_state_t& message, MapState chunk, double session_s) {
    auto whole = chunks_.Add(message.chunk, message.num_chunks, std::move(chunk));
    if (whole) {
      std::ranges::sort(whole->maps);
      NoteChange(*whole, session_s);
      groups_.Take(std::move(*whole));
    }
  }

  // By map; maps of one group share the state.
  const std::map<MapId, GroupStates<MapState>::Pointer>& by_map() const { return groups_.by_map(); }

  int pending() const { return static_cast<int>(chunks_.pending()); }

 private:
  void NoteChange(const MapState& state, double session_s) {
    const Regrouping regrouping = groups_.RegroupedBy(state);
    if (regrouping.fused || regrouping.split) {
      GroupChange change{regrouping.fused, session_s, state.revision, state.group, state.maps, {}};
      for (const KeyframePose& pose : state.keyframes) {
        auto& utime = change.newest_utime[pose.id.map];
        utime = std::max(utime, pose.utime);
      }
      session_->changes.push_back(std::move(change));
    }
  }

  CapturedSession* session_;
  StateChunks chunks_;
  GroupStates<MapState> groups_;
};

void AddPose(Bytes data, PoseTrack* track) {
  pose_t message{};
  if (!DecodeMessage(data, &message)) {
    return;
  }
  track->first_utime = std::min(track->first_utime.value_or(message.utime), message.utime);
  const bool tracks = message.state == pose_t::STATE_TRACKING;
  track->images += tracks || track->images > 0 ? 1 : 0;
  track->poses += tracks ? 1 : 0;
  if (!tracks) {
    return;
  }
  const auto map = Parse(message.map);
  const auto T_odom_body = Parse(message.T_odom_body);
  if (!map.value || !T_odom_body.value) {
    return;
  }
  auto& first = track->first_tracking_utime;
  first = std::min(first.value_or(message.utime), message.utime);
  track->maps.insert(*map.value);
  track->odometry[*map.value].push_back({message.utime, *T_odom_body.value});
  if (const auto T_map_body = Parse(message.T_map_body); T_map_body.value) {
    track->live.push_back({message.utime, *map.value, *map.value, message.group_revision,
                           *T_odom_body.value, *T_map_body.value});
  }
}

void AddMap(Bytes data, PoseTrack* track) {
  KeyframeMessage message;
  if (const auto id = DecodeMessage(data, &message) ? Parse(message.id).value : std::nullopt) {
    track->maps.insert(id->map);
  }
}

// By map and revision: the frame in which the map is shown from this revision on.
using Frames = std::map<MapId, std::map<int64_t, MapId>>;

void AddFrame(Bytes data, Frames* frames) {
  if (const auto correction = ParseMessage<correction_t>(data).value) {
    (*frames)[correction->map][correction->revision] = correction->group;
  }
}

// A pose and its correction come in any order, so frames are assigned at the end.
void Finish(const Frames& frames, PoseTrack* track) {
  for (auto& [map, odometry] : track->odometry) {
    SortByTime(&odometry);
  }
  SortByTime(&track->live);
  for (LivePose& pose : track->live) {
    const auto of_map = frames.find(pose.map);
    if (of_map != frames.end()) {
      const auto after = of_map->second.upper_bound(pose.revision);
      pose.frame = after == of_map->second.begin() ? pose.map : std::prev(after)->second;
    }
  }
}

// These return why a message is refused; empty: it is taken.
std::string AddKeyframe(Bytes data, double session_s, CapturedSession* session) {
  auto keyframe = ParseMessage<KeyframeMessage>(data);
  if (keyframe.value) {
    session->keyframes.emplace(keyframe.value->id, Captured(*keyframe.value, session_s));
    session->cameras.insert_or_assign(keyframe.value->id.map.agent_id, keyframe.value->camera);
  }
  return std::move(keyframe.refused);
}

std::string AddConstraint(Bytes data, CapturedSession* session) {
  auto constraint = ParseMessage<constraint_t>(data);
  if (constraint.value) {
    session->constraints.insert_or_assign(constraint.value->Id(), *constraint.value);
  }
  return std::move(constraint.refused);
}

std::string AddAnchorEdit(Bytes data, CapturedSession* session) {
  auto edit = ParseMessage<anchor_edit_t>(data);
  if (!edit.value) {
    return std::move(edit.refused);
  }
  std::vector<AnchorEdit>& edits = session->anchor_edits[edit.value->anchor];
  const bool known = std::ranges::any_of(edits, [&edit](const AnchorEdit& other) {
    return other.revision == edit.value->revision && other.agent_id == edit.value->agent_id;
  });
  if (!known) {
    edits.push_back(std::move(*edit.value));
  }
  return "";
}

std::string AddAnchor(Bytes data, CapturedSession* session) {
  auto state = ParseMessage<anchor_t>(data);
  if (state.value && !state.value->gone) {
    session->anchors_placed.insert(state.value->anchor);
  }
  return std::move(state.refused);
}

std::string AddState(Bytes data, double session_s, States* states) {
  map_state_t message{};
  if (!DecodeMessage(data, &message)) {
    return "map_state_t does not decode";
  }
  auto state = Parse(message);
  if (state.value) {
    states->AddChunk(message, std::move(*state.value), session_s);
  }
  return std::move(state.refused);
}

void AddSample(const status_t& status, int64_t utime, ProcessSamples* samples) {
  (*samples)[status.process].push_back(
      {utime, status.cpu_s, CounterOf(status, "bytes_up"), CounterOf(status, "bytes_down")});
}

std::string AddStatus(Bytes data, int64_t utime, CapturedSession* session) {
  status_t message{};
  if (!DecodeMessage(data, &message)) {
    return "status_t does not decode";
  }
  AddSample(message, utime, &session->samples);
  session->statuses.insert_or_assign(message.process, message);
  return "";
}

}  // namespace

CapturedSession ReadServerLog(const std::string& path, LogReadings* readings) {
  CapturedSession session;
  States states(&session);
  std::optional<int64_t> begin;
  const auto add = [&](const LogEvent& event) {
    begin = begin.value_or(event.utime);
    session.begin_utime = *begin;
    const double session_s = 1e-6 * static_cast<double>(event.utime - *begin);
    std::string refused;
    if (channels::AgentOf(event.channel, channels::kKeyframePrefix) > 0) {
      refused = AddKeyframe(event.data, session_s, &session);
    } else if (event.channel == channels::kConstraint) {
      refused = AddConstraint(event.data, &session);
    } else if (event.channel == channels::kMapState) {
      refused = AddState(event.data, session_s, &states);
    } else if (event.channel == channels::kAnchorEdit) {
      refused = AddAnchorEdit(event.data, &session);
    } else if (event.channel == channels::kAnchor ||
               channels::AgentOf(event.channel, channels::kAnchorPrefix) > 0) {
      refused = AddAnchor(event.data, &session);
    } else if (event.channel.starts_with(channels::kStatusPrefix)) {
      refused = AddStatus(event.data, event.utime, &session);
    }
    if (!refused.empty()) {
      RefusedMessages& of_channel =
          session.refused.try_emplace(event.channel, RefusedMessages{0, refused}).first->second;
      ++of_channel.count;
    }
  };
  ReadLog(path, add, readings);
  session.states = states.by_map();
  session.incomplete_states = states.pending();
  return session;
}

PoseTrack ReadPoses(const std::string& path, int32_t agent_id, LogReadings* readings) {
  PoseTrack track;
  Frames frames;
  AnchorTrackReader anchors(agent_id);
  const std::string poses = channels::Pose(agent_id);
  const std::string keyframes = channels::Keyframe(agent_id);
  const std::string corrections = channels::Correction(agent_id);
  const std::string odometry = fmt::format("vio_{}", agent_id);
  const auto add = [&](const LogEvent& event) {
    anchors.Add(event);
    if (event.channel == poses) {
      AddPose(event.data, &track);
    } else if (event.channel == keyframes) {
      AddMap(event.data, &track);
    } else if (event.channel == corrections) {
      AddFrame(event.data, &frames);
    } else if (event.channel.starts_with(channels::kStatusPrefix)) {
      status_t status{};
      if (DecodeMessage(event.data, &status)) {
        AddSample(status, event.utime, &track.samples);
        if (status.process == odometry) {
          track.images_dropped = CounterOf(status, "images_dropped").value_or(track.images_dropped);
        }
      }
    }
  };
  ReadLog(path, add, readings);
  Finish(frames, &track);
  track.anchors = anchors.Take();
  return track;
}

}  // namespace pangea

#include "viewer/scene/scene_events.h"

#include <cmath>

#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/again_t.hpp"
#include "pangea/pose_t.hpp"
#include "pangea/status_t.hpp"

namespace pangea::viewer {
namespace {

using Outcome = SceneEvents::Outcome;

// Points with a larger relative standard deviation of the depth are not drawn.
constexpr double kMaxRelativeSigma = 0.1;
constexpr size_t kMaxText = 500;

std::string Bounded(const std::string& text) { return text.substr(0, kMaxText); }

// Rays through the middles of the image's edges; if the lens model has no inverse there, those of a
// pinhole camera.
Eigen::Vector4d ViewOf(const CameraModel& camera) {
  const auto at = [&](double u, double v) {
    return camera.Unproject({u, v}).value_or(
        Eigen::Vector2d((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy));
  };
  const double right = camera.width - 1.0;
  const double bottom = camera.height - 1.0;
  return {at(0, camera.cy).x(), at(camera.cx, 0).y(), at(right, camera.cy).x(),
          at(camera.cx, bottom).y()};
}

ShownKeyframe Shown(const Keyframe& keyframe) {
  ShownKeyframe shown{keyframe.id,
                      keyframe.utime,
                      keyframe.T_odom_body,
                      keyframe.camera.T_body_cam,
                      ViewOf(keyframe.camera),
                      {},
                      {}};
  shown.corners = {keyframe.id.map,       keyframe.id.seq,        keyframe.utime,
                   keyframe.camera.width, keyframe.camera.height, {}};
  for (const Corner& corner : keyframe.corners) {
    if (corner.landmark_id != kNoLandmark) {
      shown.corners.pixels.emplace(corner.landmark_id, corner.pixel);
    }
  }
  for (const MapPoint& point : keyframe.points) {
    const double sigma = std::sqrt(static_cast<double>(point.inverse_depth_var));
    if (sigma > kMaxRelativeSigma * static_cast<double>(point.inverse_depth)) {
      continue;
    }
    if (const auto p_cam = PointInCamera(keyframe, point)) {
      const Eigen::Vector3f p_body = (keyframe.camera.T_body_cam * *p_cam).cast<float>();
      shown.points.push_back(
          {p_body, keyframe.corners[static_cast<size_t>(point.corner)].landmark_id});
    }
  }
  return shown;
}

// Empty for an invalid state.
std::string StateName(int8_t state) {
  switch (state) {
    case pose_t::STATE_INITIALISING:
      return "initialising";
    case pose_t::STATE_TRACKING:
      return "tracking";
    case pose_t::STATE_LOST:
      return "lost";
    default:
      return "";
  }
}

Outcome FromPose(const pose_t& message) {
  const Parsed<MapId> map = Parse(message.map);
  if (StateName(message.state).empty() || message.num_tracked < 0) {
    return {std::nullopt, "pose: state or number of tracks is none"};
  }
  ShownPose pose;
  pose.utime = message.utime;
  pose.state = StateName(message.state);
  pose.reason = Bounded(message.reason);
  pose.num_tracked = message.num_tracked;
  if (message.state == pose_t::STATE_TRACKING) {
    const Parsed<Rigid3> T_odom_body = Parse(message.T_odom_body);
    if (!map.value || !T_odom_body.value) {
      return {std::nullopt, "pose: " + map.refused + T_odom_body.refused};
    }
    pose.map = map.value;
    pose.T_odom_body = *T_odom_body.value;
  }
  return {pose, ""};
}

Outcome FromStatus(const status_t& message) {
  ProcessHealth health;
  health.process = Bounded(message.process);
  health.utime = message.utime;
  health.summary = Bounded(message.summary);
  health.pending = message.pending;
  health.messages_in = message.messages_in;
  health.messages_out = message.messages_out;
  health.dropped = message.dropped;
  health.resends_asked = message.resends_asked;
  health.median_ms = static_cast<double>(message.handling_median_ms);
  health.p99_ms = static_cast<double>(message.handling_p99_ms);
  health.memory_mb = static_cast<double>(message.memory_mb);
  health.cpu_s = static_cast<double>(message.cpu_s);
  for (const counter_t& counter : message.refused) {
    health.refused.emplace_back(Bounded(counter.name), counter.count);
  }
  return {health, ""};
}

// Decodes the message and converts it with `convert` (message -> Outcome); else the outcome says
// what does not decode.
template <typename Message, typename Convert>
Outcome Decoded(Bytes data, const Convert& convert) {
  Message message{};
  if (!DecodeMessage(data, &message)) {
    return {std::nullopt, std::string(Message::getTypeName()) + " does not decode"};
  }
  return convert(message);
}

template <typename Message>
Outcome Parsable(Bytes data) {
  return Decoded<Message>(data, [](const Message& message) -> Outcome {
    auto parsed = pangea::Parse(message);
    return parsed.value ? Outcome{std::move(*parsed.value), ""}
                        : Outcome{std::nullopt, parsed.refused};
  });
}

Outcome FromKeyframe(Bytes data) {
  return Decoded<KeyframeMessage>(data, [](const KeyframeMessage& message) -> Outcome {
    Parsed<Keyframe> keyframe = Parse(message);
    if (!keyframe.value) {
      return {std::nullopt, keyframe.refused};
    }
    return {Shown(*keyframe.value), "", std::move(keyframe.value)};
  });
}

Outcome FromPoseOf(int32_t agent_id, Bytes data) {
  Outcome outcome = Decoded<pose_t>(data, FromPose);
  if (outcome.event) {
    std::get<ShownPose>(*outcome.event).agent_id = agent_id;
  }
  return outcome;
}

}  // namespace

Outcome SceneEvents::FromImage(int32_t agent_id, Bytes data) {
  return Decoded<image_t>(data, [this, agent_id](const image_t& message) -> Outcome {
    std::string refused;
    auto whole = images_.Add(agent_id, message, &refused);
    return whole ? Outcome{std::make_shared<const ShownImage>(std::move(*whole)), ""}
                 : Outcome{std::nullopt, refused};
  });
}

Outcome SceneEvents::FromMapState(Bytes data) {
  return Decoded<map_state_t>(data, [this](const map_state_t& message) -> Outcome {
    Parsed<MapState> chunk = pangea::Parse(message);
    if (!chunk.value) {
      return {std::nullopt, chunk.refused};
    }
    auto whole = chunks_.Add(message.chunk, message.num_chunks, std::move(*chunk.value));
    return whole ? Outcome{std::move(*whole), ""} : Outcome{};
  });
}

// A retransmitted message is parsed as the original would be.
Outcome SceneEvents::FromRetransmission(Bytes data) {
  return Decoded<again_t>(data, [this](const again_t& message) {
    const bool nested = message.channel.starts_with(channels::kAgainPrefix);
    return nested ? Outcome{std::nullopt, "again: within another"}
                  : Parse(message.channel, {message.data.data(), message.data.size()});
  });
}

Outcome SceneEvents::Parse(const std::string& channel, Bytes data) {
  if (channels::AgentOf(channel, channels::kKeyframePrefix) > 0) {
    return FromKeyframe(data);
  }
  if (const int32_t agent_id = channels::AgentOf(channel, channels::kPosePrefix); agent_id > 0) {
    return FromPoseOf(agent_id, data);
  }
  if (const int32_t agent_id = channels::AgentOf(channel, channels::kImagePrefix); agent_id > 0) {
    return FromImage(agent_id, data);
  }
  if (channels::AgentOf(channel, channels::kCorrectionPrefix) > 0) {
    return Parsable<correction_t>(data);
  }
  if (channel == channels::kConstraint) {
    return Parsable<constraint_t>(data);
  }
  if (channel == channels::kAnchor) {
    return Parsable<anchor_t>(data);
  }
  if (channel == channels::kMapState) {
    return FromMapState(data);
  }
  if (channel.starts_with(channels::kStatusPrefix)) {
    return Decoded<status_t>(data, FromStatus);
  }
  if (channel.starts_with(channels::kAgainPrefix)) {
    return FromRetransmission(data);
  }
  return {};
}

}  // namespace pangea::viewer

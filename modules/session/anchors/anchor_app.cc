#include "session/anchors/anchor_app.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <stdexcept>

#include "bus/process.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/keyframe_message.h"
#include "pangea/pose_t.hpp"
#include "recording/euroc.h"

namespace pangea::session {
namespace {

// The agent would place it in another image, or never.
void CheckPlayed(const AnchorScript& anchor, const AgentScript& agent) {
  const double end_s = agent.start_s + agent.duration_s;
  if (agent.live || !agent.keyframes.empty()) {
    return;  // its recording is not what is played
  }
  if (anchor.at_s < agent.start_s || (agent.duration_s > 0 && anchor.at_s > end_s)) {
    throw std::runtime_error(
        fmt::format("anchors: {}: 'at' is {:g} s, and agent {} plays its recording from {:g} s {}",
                    anchor.name, anchor.at_s, agent.id, agent.start_s,
                    agent.duration_s > 0 ? fmt::format("to {:g} s", end_s) : "on"));
  }
}

PlannedAnchor Plan(const AnchorScript& anchor, const EurocRecording& recording) {
  const std::vector<EurocImage>& images = recording.images();
  const double end_s = 1e-6 * static_cast<double>(images.back().utime - images.front().utime);
  if (anchor.at_s > end_s) {
    throw std::runtime_error(
        fmt::format("anchors: {}: 'at' is {:g} s, and the recording of agent {} ends at {:.1f} s",
                    anchor.name, anchor.at_s, anchor.agent, end_s));
  }
  if (const CameraModel& camera = recording.camera(); !camera.Contains(anchor.pixel)) {
    throw std::runtime_error(fmt::format(
        "anchors: {}: 'pixel' [{:g}, {:g}] is outside the images of agent {}: {} x {}", anchor.name,
        anchor.pixel.x(), anchor.pixel.y(), anchor.agent, camera.width, camera.height));
  }
  const int64_t at = images.front().utime + std::llround(1e6 * anchor.at_s);
  const auto nearest = std::ranges::min_element(
      images, {}, [at](const EurocImage& image) { return std::abs(image.utime - at); });
  return {anchor, nearest->utime};
}

}  // namespace

std::vector<PlannedAnchor> PlanAnchors(const SessionScript& script) {
  std::map<int32_t, std::unique_ptr<EurocRecording>> recordings;
  std::vector<PlannedAnchor> planned;
  for (const AnchorScript& anchor : script.anchors) {
    const auto agent = std::ranges::find(script.agents, anchor.agent, &AgentScript::id);
    CheckPlayed(anchor, *agent);
    std::unique_ptr<EurocRecording>& recording = recordings[anchor.agent];
    if (!recording) {
      recording = std::make_unique<EurocRecording>(agent->resolved.string());
    }
    planned.push_back(Plan(anchor, *recording));
  }
  return planned;
}

void AnchorApp::Join(const AgentScript& agent, Bus* bus) {
  const int32_t id = agent.id;
  buses_[id] = bus;
  if (agent.keyframes.empty()) {
    bus->Subscribe(channels::Pose(id),
                   [this, id](const std::string&, Bytes data) { OnPose(id, data); });
  } else {
    bus->Subscribe(channels::Keyframe(id),
                   [this, id](const std::string&, Bytes data) { OnKeyframe(id, data); });
  }
  bus->Subscribe(channels::Anchor(id),
                 [this, id](const std::string&, Bytes data) { OnAnchor(id, data); });
}

void AnchorApp::OnPose(int32_t agent, Bytes data) {
  pose_t message;
  if (!DecodeMessage(data, &message)) {
    return;
  }
  const auto map = Parse(message.map);
  const bool tracking = message.state == pose_t::STATE_TRACKING && map.value;
  placer_.OnPose(agent, message.utime, tracking ? map.value : std::nullopt, WallUtime());
}

void AnchorApp::OnKeyframe(int32_t agent, Bytes data) {
  KeyframeMessage message;
  if (!DecodeMessage(data, &message)) {
    return;
  }
  if (const auto map = Parse(message.id.map); map.value) {
    placer_.OnPose(agent, message.utime, map.value, WallUtime());
  }
}

void AnchorApp::OnAnchor(int32_t agent, Bytes data) {
  if (const auto state = ParseMessage<anchor_t>(data); state.value) {
    placer_.OnAnchor(agent, state.value->anchor, state.value->revision);
  }
}

void AnchorApp::Step() {
  for (const AnchorEdit& edit : placer_.TakeDue(WallUtime())) {
    buses_.at(edit.agent_id)
        ->Publish(channels::AnchorRequest(edit.agent_id), EncodeMessage(ToMessage(edit)));
  }
}

}  // namespace pangea::session

#pragma once

// The anchors of a session file on the agents' buses: reads the recordings' times, hears POSE_k (of
// stored keyframes KEYFRAME_k) and ANCHOR_k, publishes ANCHOR_REQUEST_k.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "session/anchors/anchor_placer.h"

namespace pangea::session {

// Each anchor with the image of the agent's recording nearest to its time. Throws
// std::runtime_error when a recording cannot be read, has ended by then, or has no such pixel.
std::vector<PlannedAnchor> PlanAnchors(const SessionScript& script);

class AnchorApp {
 public:
  explicit AnchorApp(std::vector<PlannedAnchor> anchors) : placer_(std::move(anchors)) {}

  // Before the agent starts. The bus must outlive this, and is not handled after it.
  void Join(const AgentScript& agent, Bus* bus);
  // Publishes what is due.
  void Step();
  std::vector<std::string> NotPlaced() const { return placer_.NotPlaced(); }

 private:
  void OnPose(int32_t agent, Bytes data);
  void OnKeyframe(int32_t agent, Bytes data);
  void OnAnchor(int32_t agent, Bytes data);

  AnchorPlacer placer_;
  std::map<int32_t, Bus*> buses_;
};

}  // namespace pangea::session

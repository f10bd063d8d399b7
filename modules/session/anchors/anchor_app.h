#pragma once

// Places a session file's anchors on the agents' buses: reads the recordings' times, receives
// POSE_k (for stored keyframes KEYFRAME_k) and ANCHOR_k, publishes ANCHOR_REQUEST_k.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bus/bus.h"
#include "session/anchors/anchor_placer.h"

namespace pangea::session {

// Assigns to each anchor the image of the agent's recording nearest to its time. Throws
// std::runtime_error if a recording cannot be read, is over or not played then, or has no such
// pixel.
std::vector<PlannedAnchor> PlanAnchors(const SessionScript& script);

class AnchorApp {
 public:
  explicit AnchorApp(std::vector<PlannedAnchor> anchors) : placer_(std::move(anchors)) {}

  // Call before the agent starts. The bus must outlive this object, and must not be handled after
  // this object is gone.
  void Join(const AgentScript& agent, Bus* bus);
  // Publishes the requests that are due.
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

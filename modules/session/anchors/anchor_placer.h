#pragma once

// Places the anchors of a session file, like an app on each agent's bus: when the agent's odometry
// has tracked the image, it requests the anchor, and repeats this every second until the agent
// receives the anchor. Uses no bus and no clock.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/anchor.h"
#include "session/session_file/session_file.h"

namespace pangea::session {

struct PlannedAnchor {
  AnchorScript script;
  int64_t image_utime = 0;  // of the image that shows it, sensor clock, microseconds
};

class AnchorPlacer {
 public:
  explicit AnchorPlacer(std::vector<PlannedAnchor> anchors);

  // Call for each pose of an agent's odometry, or for each stored keyframe, in time order. `map`:
  // empty while the odometry does not track. `now_us`: wall clock, here and below.
  void OnPose(int32_t agent, int64_t utime, const std::optional<MapId>& map, int64_t now_us);
  // Call for each anchor that the agent receives.
  void OnAnchor(int32_t agent, const AnchorId& anchor, int64_t revision);

  // The requests to publish now, for all agents (AnchorEdit::agent_id).
  std::vector<AnchorEdit> TakeDue(int64_t now_us);

  // One line for each anchor that its agent has not received, with the reason.
  std::vector<std::string> NotPlaced() const;

 private:
  struct Task {
    PlannedAnchor planned;
    std::optional<AnchorEdit> request;  // set when the odometry has tracked the image
    int64_t due_us = 0;                 // time of the next request
    bool heard = false;
  };
  // A period of uninterrupted tracking of an agent's odometry.
  struct Tracked {
    MapId map;
    int64_t since_utime = 0;
  };

  void Request(const Tracked& tracked, int64_t now_us, Task* task);

  std::vector<Task> tasks_;
  std::map<int32_t, Tracked> tracked_;  // by agent
  int64_t last_created_ = 0;
};

}  // namespace pangea::session

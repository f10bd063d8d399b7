#pragma once

// Places the anchors of a session file, as an app on each agent's bus would: when the agent's
// odometry has tracked the image it requests the anchor, and again every second until the agent
// hears of it. Knows no bus and no clock.

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

  // A pose of an agent's odometry, or a stored keyframe; in the order of their times. `map`: none
  // while it does not track. `now_us`: wall clock, here and below.
  void OnPose(int32_t agent, int64_t utime, const std::optional<MapId>& map, int64_t now_us);
  // An anchor that the agent has heard of.
  void OnAnchor(int32_t agent, const AnchorId& anchor, int64_t revision);

  // What is to be published now, of any agent (AnchorEdit::agent_id).
  std::vector<AnchorEdit> TakeDue(int64_t now_us);

  // The anchors that no agent has heard of, and why; a line each.
  std::vector<std::string> NotPlaced() const;

 private:
  struct Task {
    PlannedAnchor planned;
    std::optional<AnchorEdit> request;  // since the odometry has tracked the image
    int64_t due_us = 0;                 // of the next request
    bool heard = false;
  };
  // While an agent's odometry tracks without a break.
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

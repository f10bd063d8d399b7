#pragma once

// The border: what comes on a bus or out of a log becomes what a Scene takes, or is refused with a
// reason.

#include <optional>
#include <string>
#include <variant>

#include "common/bus/bus.h"
#include "common/state_chunks.h"
#include "viewer/scene.h"

namespace pangea::viewer {

using SceneEvent =
    std::variant<ShownKeyframe, ShownPose, Constraint, Correction, MapState, ProcessHealth>;

class SceneEvents {
 public:
  struct Outcome {
    std::optional<SceneEvent> event;  // also none for a chunk of a state that is not whole yet
    std::string refused;
  };
  // By the channel's name; what is not shown is neither an event nor refused.
  Outcome Parse(const std::string& channel, Bytes data);

 private:
  StateChunks chunks_;
};

}  // namespace pangea::viewer

#pragma once

// The border: what comes on a bus or out of a log becomes what a Scene takes, or is refused with a
// reason.

#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "bus/bus.h"
#include "messages/state_chunks.h"
#include "viewer/image_parts.h"
#include "viewer/scene/scene.h"

namespace pangea::viewer {

using SceneEvent = std::variant<ShownKeyframe, ShownPose, std::shared_ptr<const ShownImage>,
                                Constraint, Correction, MapState, ProcessHealth, AnchorState>;

class SceneEvents {
 public:
  struct Outcome {
    // Also none for a chunk of a state or an image that is not whole yet.
    std::optional<SceneEvent> event;
    std::string refused;
  };
  // By the channel's name; what is not shown is neither an event nor refused.
  Outcome Parse(const std::string& channel, Bytes data);

 private:
  Outcome FromImage(int32_t agent_id, Bytes data);
  Outcome FromMapState(Bytes data);
  Outcome FromRetransmission(Bytes data);

  StateChunks chunks_;
  ImageParts images_;
};

}  // namespace pangea::viewer

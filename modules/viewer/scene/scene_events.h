#pragma once

// Messages from a bus or a log are parsed to the events that a Scene takes, or refused with a
// reason.

#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "core/bytes.h"
#include "messages/state_chunks.h"
#include "viewer/image_parts.h"
#include "viewer/scene/scene.h"

namespace pangea::viewer {

using SceneEvent = std::variant<ShownKeyframe, ShownPose, std::shared_ptr<const ShownImage>,
                                Constraint, Correction, MapState, ProcessHealth, AnchorState>;

class SceneEvents {
 public:
  struct Outcome {
    // Nothing also for a chunk of a state or an image of which other chunks are missing.
    std::optional<SceneEvent> event;
    std::string refused;
    std::optional<Keyframe> keyframe = {};  // all of the shown keyframe
  };
  // The channel's name decides the type. Messages that are not shown give neither an event nor a
  // reason.
  Outcome Parse(const std::string& channel, Bytes data);

 private:
  Outcome FromImage(int32_t agent_id, Bytes data);
  Outcome FromMapState(Bytes data);
  Outcome FromRetransmission(Bytes data);

  StateChunks chunks_;
  ImageParts images_;
};

}  // namespace pangea::viewer

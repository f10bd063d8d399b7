#pragma once

// The agent_handler's options as they stand in a file: `pangea-agent-handler --print-options`.

#include "agent_handler/receiver.h"

namespace pangea {

struct AgentHandlerOptions {
  ReceiverOptions receiver;
  // Of the command line: what other hosts do not have too is not acknowledged.
  bool replicated = false;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("cache_bytes", &receiver.cache_bytes, {2 * kMaxKeyframeBytes, 1 << 30}, "B",
                "keyframes of an agent that are not whole, or not yet on the disk");
  }
};

}  // namespace pangea

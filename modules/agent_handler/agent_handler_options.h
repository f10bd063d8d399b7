#pragma once

// The options of the agent_handler in an options file (`pangea-agent-handler --print-options`).

#include "agent_handler/receiver.h"

namespace pangea {

struct AgentHandlerOptions {
  ReceiverOptions receiver;
  // Set on the command line: acknowledge only what other hosts also have (journal/replication.h).
  bool replicated = false;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("cache_bytes", &receiver.cache_bytes, {2 * kMaxKeyframeBytes, 1 << 30}, "B",
                "keyframes of an agent that are not whole, or not yet on the disk");
  }
};

}  // namespace pangea

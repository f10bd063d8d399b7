#pragma once

// The agent_handler's options as they stand in a file: `pangea-agent-handler --print-options`.

#include "agent_handler/journal/archive.h"
#include "agent_handler/receiver.h"

namespace pangea {

struct AgentHandlerOptions {
  ReceiverOptions receiver;
  ArchiveOptions archive;

  template <typename Archive>
  void Visit(Archive& archive_of_options) {
    archive_of_options.Add("cache_bytes", &receiver.cache_bytes, {2 * kMaxKeyframeBytes, 1 << 30},
                           "B", "keyframes of an agent that are not whole, or not yet on the disk");
    archive_of_options.Add("sync_interval_us", &archive.sync_interval_us, {0, 1e6}, "us",
                           "what arrives within it shares one write to the disk");
    archive_of_options.Add("resend_kb_per_s", &archive.resend_kb_per_s, {1, 1e6}, "kB/s",
                           "retransmissions to the server's processes");
  }
};

}  // namespace pangea

#pragma once

// Connects to NATS over libnats, with TLS and a password if they are given.

#include <nats/nats.h>

#include <cstdint>
#include <memory>
#include <string>

#include "cluster/nats/nats_access.h"

namespace pangea {

struct NatsDeleter {
  void operator()(natsConnection* connection) const { natsConnection_Destroy(connection); }
  void operator()(natsOptions* options) const { natsOptions_Destroy(options); }
  void operator()(natsSubscription* subscription) const { natsSubscription_Destroy(subscription); }
  void operator()(natsMsg* message) const { natsMsg_Destroy(message); }
  void operator()(jsCtx* context) const { jsCtx_Destroy(context); }
  void operator()(jsConsumerInfo* info) const { jsConsumerInfo_Destroy(info); }
  void operator()(jsStreamInfo* info) const { jsStreamInfo_Destroy(info); }
  void operator()(jsPubAck* answer) const { jsPubAck_Destroy(answer); }
};
// An object of libnats.
template <typename T>
using NatsOwned = std::unique_ptr<T, NatsDeleter>;

// The connection reconnects by itself. `name`: by which NATS' own tools show it. Throws
// std::runtime_error, with the URL and advice.
NatsOwned<natsConnection> ConnectToNats(const NatsAccess& access, const std::string& name,
                                        int64_t timeout_ms);

}  // namespace pangea

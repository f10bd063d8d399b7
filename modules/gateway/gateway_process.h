#pragma once

// The gateway process, between phones' browsers and the link bus, on one thread.
//   HTTPS, WSS  gateway.h
//   link bus    LINK_DOWN_* in; LINK_UP_k out
//   server bus  STATUS_gateway out
// Keys and names are read again every second if they changed, so agents can join and leave while it
// runs. Every hour it looks whether its certificate must be renewed.

#include <cstdint>
#include <string>

#include "bus/node.h"
#include "gateway/admission.h"
#include "gateway/gateway.h"
#include "gateway/identity.h"
#include "gateway/recording/recording_folder.h"
#include "link/agent_key.h"
#include "web/web_server.h"

namespace pangea {

class GatewayProcess {
 public:
  static constexpr int64_t kDefaultMaxRecordings = 20'000'000'000;
  struct Options {
    web::WebOptions web;  // `tls` is not used; `identity` has it
    web::Page page;
    GatewayIdentity identity;
    std::string url_host;                            // the host in the URL for phones
    int64_t max_recordings = kDefaultMaxRecordings;  // bytes, for all recordings together
  };

  // Throws std::runtime_error if it cannot listen or the site's folder cannot be used.
  GatewayProcess(Bus& link_bus, Bus& server_bus, const site::Site& site, const Options& options);

  // Handles requests and sockets for `timeout_ms`; with 0, only what is already there.
  void Serve(int timeout_ms);
  // Call it at about 10 Hz. `now_utime`: as for Process::Tick. `date_s`: seconds since 1970 by the
  // system's clock, which may have been set since the start: codes and certificates expire by it.
  void Tick(int64_t now_utime, int64_t date_s);

  const GatewayAddress& address() const { return address_; }
  uint16_t port() const { return server_.port(); }

 private:
  Gateway::Events Events();
  JoinResult Join(const JoinRequest& request);
  void ReadAgents();
  void LookForKeys();
  void RenewCertificate();
  void PublishStatus(int64_t now_utime);

  Bus& link_bus_;
  const site::Site site_;
  GatewayIdentity identity_;
  Node node_;
  Admission admission_;
  KeyFolder key_folder_;
  std::map<int32_t, Gateway::Agent> agents_;
  RecordingFolder recordings_;
  Gateway gateway_;
  web::WebServer server_;
  GatewayAddress address_;
  int64_t date_s_ = 0;
  int64_t next_look_utime_ = 0;
  int64_t next_renewal_utime_ = 0;
};

}  // namespace pangea

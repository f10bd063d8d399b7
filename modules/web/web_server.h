#pragma once

// Gives out a site over HTTP or HTTPS and keeps WebSockets to those that want one, on one thread:
// nothing runs outside Serve. Bounded: kMaxConnections at once that ask (a further one takes the
// place of the one that has asked for or taken nothing for longest), WebOptions::max_peers with a
// socket (more are told so), headers of 8 kB, bodies of kMaxBody, socket messages of
// WebPeer::max_message_bytes, one message under way per peer. Closed is who takes more than 5 s for
// a TLS handshake or to ask, 30 s to take an answer or a message, or has a socket and is silent for
// 30 s (it is pinged before). A site that has not answered within 10 s has its asker told 503.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "web/web_site.h"

namespace pangea::web {

// As PEM texts: the server's certificate, then those that vouch for it; and its key.
struct TlsIdentity {
  std::string certificate_chain_pem;
  std::string private_key_pem;
};

struct WebOptions {
  std::string listen = "127.0.0.1";
  uint16_t port = 8080;            // 0: a free one
  std::vector<std::string> names;  // of this machine, as those who ask may call it
  // An interface for programs: they need no Origin header to open a WebSocket; and pages of other
  // origins get no answer to anything. Else these may ask (and their browsers keep the answer from
  // them), but open no WebSocket.
  bool for_programs = false;
  std::vector<std::string> origins = {};  // whose pages may use it as this server's own (CORS)
  int max_peers = 16;
  std::optional<TlsIdentity> tls = {};  // HTTPS, and nothing else
};

class WebServer {
 public:
  static constexpr int kMaxConnections = 100;
  static constexpr size_t kMaxBody = 16'384;

  // `site` outlives it. Throws std::runtime_error when it cannot listen there, for an origin that
  // is none, or a certificate that cannot be used.
  WebServer(const WebOptions& options, WebSite& site);
  ~WebServer();

  uint16_t port() const;
  // Sends every peer what there is for it and handles what is asked, for `timeout_ms`; 0: what is
  // there already.
  void Serve(int timeout_ms);

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace pangea::web

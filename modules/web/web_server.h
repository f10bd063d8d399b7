#pragma once

// Serves a WebSite over HTTP or HTTPS, with WebSockets, on one thread: nothing runs outside Serve.
//
// Bounds: kMaxConnections HTTP connections (a further one replaces the one that has been idle for
// longest), WebOptions::max_peers WebSockets (more are refused), headers of 8 kB, bodies of
// kMaxBody, WebSocket messages of WebPeer::max_message_bytes, one outgoing message per peer.
//
// Time-outs: a connection is closed if a TLS handshake or a request takes more than 5 s, or if
// taking an answer or a message takes more than 30 s. A WebSocket is closed after 30 s of silence,
// after a ping. If the site does not answer within 10 s, the client gets 503.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "web/web_site.h"

namespace pangea::web {

// PEM texts: the server's certificate followed by its chain of issuers, and the private key.
struct TlsIdentity {
  std::string certificate_chain_pem;
  std::string private_key_pem;
};

struct WebOptions {
  std::string listen = "127.0.0.1";
  uint16_t port = 8080;            // 0: any free port
  std::vector<std::string> names;  // host names of this machine that clients may use
  // True for an interface for programs: a client without Origin header may open a WebSocket, and
  // all requests of pages of other origins are refused. False: such pages get answers (which
  // browsers hide from them), but cannot open a WebSocket.
  bool for_programs = false;
  std::vector<std::string> origins = {};  // their pages may use the server as its own (CORS)
  int max_peers = 16;
  std::optional<TlsIdentity> tls = {};  // if set, HTTPS only
};

class WebServer {
 public:
  static constexpr int kMaxConnections = 100;
  static constexpr size_t kMaxBody = 16'384;

  // `site` must outlive the server. Throws std::runtime_error when the server cannot listen, an
  // origin is malformed, or the certificate cannot be used.
  WebServer(const WebOptions& options, WebSite& site);
  ~WebServer();

  uint16_t port() const;
  // For a server with WebOptions::tls: further connections get this certificate. Throws as the
  // constructor does; then the present certificate stays.
  void UseIdentity(const TlsIdentity& identity);
  // Sends messages to the peers and handles requests for `timeout_ms`; with 0, only what is already
  // there.
  void Serve(int timeout_ms);

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace pangea::web

#pragma once

// Gives out the page over HTTP and keeps a WebSocket to each browser that shows it, on one thread:
// nothing runs outside Serve. Bounded: kMaxConnections at once (more are closed), kMaxBrowsers of
// them with a socket (more are told so), requests of 8 kB, socket messages of PageLink::kMaxText,
// one update under way per browser; who is silent for 30 s is closed.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "viewer/show.h"
#include "viewer/web/web_rules.h"

namespace pangea::viewer {

struct WebOptions {
  std::string listen = "127.0.0.1";
  uint16_t port = 8080;            // 0: a free one
  std::vector<std::string> names;  // of this machine, as browsers may call it
};

class WebServer {
 public:
  static constexpr int kMaxConnections = 100;
  static constexpr int kMaxBrowsers = 16;

  // Throws std::runtime_error when it cannot listen there.
  WebServer(const WebOptions& options, std::map<std::string, PageFile> page, Show& show);
  ~WebServer();

  uint16_t port() const;
  // Sends every page its update and handles what browsers ask, for `timeout_ms`.
  void Serve(int timeout_ms);

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace pangea::viewer

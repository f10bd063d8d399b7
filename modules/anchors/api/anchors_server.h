#pragma once

// AnchorsProcess with its API on a web server: HTTP and WebSockets are served between messages.

#include <memory>
#include <string>

#include "anchors/anchors_process.h"
#include "anchors/api/anchor_api.h"
#include "web/web_server.h"

namespace pangea {

// "127.0.0.1:8090" or "[::1]:8090"; port 0: any free port. Throws std::runtime_error if the text is
// not an address and port.
web::WebOptions ListenAt(const std::string& address_and_port);

class AnchorsServer : public Process {
 public:
  // Throws std::runtime_error if it cannot listen there; prints the address on stdout.
  AnchorsServer(Bus& bus, const AnchorsOptions& options, std::shared_ptr<RecordStore> records,
                const web::WebOptions& web_options);

  void Tick(int64_t now_utime) override { process_.Tick(now_utime); }
  void BetweenMessages(int64_t now_utime) override;
  // Limits the delay between a request and its answer.
  int longest_wait_ms() const override { return 10; }

  uint16_t port() const { return server_.port(); }

 private:
  AnchorsProcess process_;
  AnchorApi api_;
  web::WebServer server_;
};

}  // namespace pangea

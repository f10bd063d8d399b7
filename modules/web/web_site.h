#pragma once

// The interface of a site that a WebServer serves. A site answers requests, at once or later, and
// opens WebSockets. Everything is called on the server's thread, within WebServer::Serve.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace pangea::web {

struct WebRequest {
  std::string method;        // "GET" (also for HEAD), "POST", ...
  std::string target;        // as it was sent, not decoded: "/v1/anchors?group=1%2F2"
  std::string host;          // the Host header; HostAllowed has accepted it
  std::string if_match;      // the If-Match header, or empty
  std::string body;          // at most WebServer::kMaxBody
  std::string address = {};  // IP address of the client
  bool takes_gzip = false;
};

struct WebAnswer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";  // MIME
  std::string body;
  // Headers that are added to the server's own, or replace them.
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::shared_ptr<const std::string> file = {};  // replaces `body` if set; it is not copied
};

// Why a WebSocket is closed, for the other end's program. RFC 6455, 7.4: the codes 4000 to 4999 are
// free to use.
struct WebEnding {
  uint16_t code = 0;
  std::string reason;  // at most 123 bytes
};

// The application's end of a WebSocket, without the socket. The server asks for the next message
// only after the last one was sent, so the peer itself bounds its queue.
class WebPeer {
 public:
  static constexpr size_t kMaxText = 1000;

  virtual ~WebPeer() = default;
  // Bound for received messages: a larger one closes the WebSocket.
  virtual size_t max_message_bytes() const { return kMaxText; }
  // Whether sent messages are UTF-8 text; else they are binary.
  virtual bool is_text() const = 0;
  // The next message to send, if any.
  virtual std::optional<std::vector<uint8_t>> Next() = 0;
  // Handles a received message. False if it is not valid: this closes the WebSocket.
  virtual bool Receive(std::string_view text) = 0;
  // If set, the WebSocket is closed with it once Next has no more messages.
  virtual std::optional<WebEnding> Ending() const { return std::nullopt; }
};

class WebSite {
 public:
  // May be called later, even if the client is gone. Only the first call counts.
  using Reply = std::function<void(WebAnswer)>;

  virtual ~WebSite() = default;
  virtual void Answer(const WebRequest& request, Reply reply) = 0;
  // Null if there is no WebSocket at this target.
  virtual std::unique_ptr<WebPeer> Open(const WebRequest& request) = 0;
  // Called with the reason when the server itself refused something, to count it. There are few
  // different reasons.
  virtual void Refused(const std::string&) {}
};

}  // namespace pangea::web

#pragma once

// What a WebServer gives out. A site answers requests, at once or later, and opens WebSockets. All
// of it is called on the server's thread, within WebServer::Serve.

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
  std::string method;        // "GET", which a HEAD is here too, "POST", ...
  std::string target;        // as it was sent: "/v1/anchors?group=1%2F2"
  std::string host;          // one that HostAllowed has let through
  std::string if_match;      // the header, or empty
  std::string body;          // at most WebServer::kMaxBody
  std::string address = {};  // IP address of who asks
  bool takes_gzip = false;
};

struct WebAnswer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";  // MIME
  std::string body;
  // In place of the server's own, or besides.
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::shared_ptr<const std::string> file = {};  // in place of `body`, and not copied
};

// Why a conversation is over, for the other side's program (RFC 6455, 7.4: 4000 to 4999 are free).
struct WebEnding {
  uint16_t code = 0;
  std::string reason;  // at most 123 bytes
};

// One end of a WebSocket, without the socket. What is not yet sent is the peer's to bound: it is
// asked for the next message once the last one has gone out.
class WebPeer {
 public:
  static constexpr size_t kMaxText = 1000;

  virtual ~WebPeer() = default;
  // Of what is received: a larger message ends the conversation.
  virtual size_t max_message_bytes() const { return kMaxText; }
  // Whether messages are UTF-8 text; else they are binary.
  virtual bool is_text() const = 0;
  // What to send now, if anything.
  virtual std::optional<std::vector<uint8_t>> Next() = 0;
  // False for what nobody of ours says: it ends the conversation.
  virtual bool Receive(std::string_view text) = 0;
  // Set once this end has nothing more to say, after what Next still has.
  virtual std::optional<WebEnding> Ending() const { return std::nullopt; }
};

class WebSite {
 public:
  // May be called later, also when nobody waits any more. The first call counts.
  using Reply = std::function<void(WebAnswer)>;

  virtual ~WebSite() = default;
  virtual void Answer(const WebRequest& request, Reply reply) = 0;
  // Null: there is no WebSocket at this target.
  virtual std::unique_ptr<WebPeer> Open(const WebRequest& request) = 0;
  // What the server refused by itself, to be counted; the reasons are few.
  virtual void Refused(const std::string&) {}
};

}  // namespace pangea::web

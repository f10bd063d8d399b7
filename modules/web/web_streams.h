#pragma once

// Shared by the parts of the server: its streams, with and without TLS, and the state of one
// server.

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl.hpp>
#include <chrono>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>

#include "web/web_server.h"

namespace pangea::web {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using tcp = asio::ip::tcp;
using Request = http::request<http::string_body>;

using PlainStream = beast::tcp_stream;
using TlsStream = beast::ssl_stream<beast::tcp_stream>;
template <typename Stream>
inline constexpr bool kIsTls = std::is_same_v<Stream, TlsStream>;

constexpr uint32_t kMaxHeader = 8192;
// Time-outs.
constexpr std::chrono::seconds kAsking{5};      // for a TLS handshake; for a whole request
constexpr std::chrono::seconds kAnswering{10};  // for the site's answer
constexpr std::chrono::seconds kTaking{30};     // for sending an answer, or a WebSocket message
constexpr std::chrono::seconds kSilence{30};    // of a WebSocket's client

// A Connection over either kind of stream.
class AnyConnection {
 public:
  virtual ~AnyConnection() = default;
  virtual void Close() = 0;
};
class AnySocket {
 public:
  virtual ~AnySocket() = default;
  // Sends the peer's next message, or closes the WebSocket if the peer is done.
  virtual void SendNext() = 0;
};

struct ServerState {
  ServerState(const WebOptions& web_options, WebSite& web_site)
      : options(web_options), site(web_site) {}

  WebOptions options;
  WebSite& site;
  // The HTTP connections; the first one has been busy with a request or answer, or idle, for
  // longest. They live at most as long as `io`.
  std::list<AnyConnection*> connections;
  asio::io_context io{1};
  std::list<std::weak_ptr<AnySocket>> sockets;
};

}  // namespace pangea::web

#pragma once

// What the server's parts share: its streams, with and without TLS, and the state of one server.

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
constexpr std::chrono::seconds kAsking{5};      // a TLS handshake; a whole request
constexpr std::chrono::seconds kAnswering{10};  // the site
constexpr std::chrono::seconds kTaking{30};     // a whole answer; a message on a socket
constexpr std::chrono::seconds kSilence{30};

// Of either stream.
class AnyConnection {
 public:
  virtual ~AnyConnection() = default;
  virtual void Close() = 0;
};
class AnySocket {
 public:
  virtual ~AnySocket() = default;
  // What there is to send, and whether the conversation is over.
  virtual void SendNext() = 0;
};

struct ServerState {
  ServerState(const WebOptions& web_options, WebSite& web_site)
      : options(web_options), site(web_site) {}

  WebOptions options;
  WebSite& site;
  // That ask; first the one whose request or answer has been under way for longest. They live as
  // long as `io`.
  std::list<AnyConnection*> connections;
  asio::io_context io{1};
  std::list<std::weak_ptr<AnySocket>> sockets;
};

}  // namespace pangea::web

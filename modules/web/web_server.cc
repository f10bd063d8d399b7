#include "web/web_server.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <list>
#include <optional>
#include <stdexcept>
#include <utility>

#include "web/web_rules.h"

namespace pangea::web {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using Request = http::request<http::string_body>;

constexpr uint32_t kMaxHeader = 8192;
constexpr std::chrono::seconds kAsking{5};      // a whole request
constexpr std::chrono::seconds kAnswering{10};  // the site
constexpr std::chrono::seconds kTaking{30};     // a whole answer
constexpr std::chrono::seconds kSilence{30};

constexpr const char* kNothing = "default-src 'none'; frame-ancestors 'none'";

std::string Text(boost::beast::string_view text) { return {text.data(), text.size()}; }

class Connection;  // see below

// The server's end of a WebSocket.
class Socket : public std::enable_shared_from_this<Socket> {
 public:
  Socket(beast::tcp_stream stream, std::unique_ptr<WebPeer> peer)
      : socket_(std::move(stream)), peer_(std::move(peer)) {}

  void Open(Request request) {
    auto timeout = websocket::stream_base::timeout::suggested(beast::role_type::server);
    timeout.idle_timeout = kSilence;
    socket_.set_option(timeout);
    socket_.read_message_max(WebPeer::kMaxText);
    socket_.text(peer_->is_text());
    request_ = std::move(request);
    socket_.async_accept(request_, [self = shared_from_this()](beast::error_code error) {
      self->open_ = !error;
      if (!error) {
        self->Read();
      }
    });
  }

  void SendNext() {
    if (!open_ || sending_) {
      return;
    }
    auto message = peer_->Next();
    if (!message) {
      return;
    }
    message_ = std::move(*message);
    sending_ = true;
    socket_.async_write(asio::buffer(message_),
                        [self = shared_from_this()](beast::error_code error, size_t) {
                          self->sending_ = false;
                          self->open_ = self->open_ && !error;
                          self->SendNext();
                        });
  }

 private:
  void Read() {
    socket_.async_read(buffer_, [self = shared_from_this()](beast::error_code error, size_t) {
      if (error) {
        self->open_ = false;
        return;
      }
      const auto data = self->buffer_.cdata();
      const bool understood =
          self->peer_->Receive({static_cast<const char*>(data.data()), data.size()});
      self->buffer_.clear();
      if (understood) {
        self->Read();
      } else {
        self->open_ = false;
        self->socket_.async_close(websocket::close_code::policy_error,
                                  [self](beast::error_code) {});
      }
    });
  }

  websocket::stream<beast::tcp_stream> socket_;
  const std::unique_ptr<WebPeer> peer_;
  Request request_;
  beast::flat_buffer buffer_;
  std::vector<uint8_t> message_;
  bool open_ = false;
  bool sending_ = false;
};

}  // namespace

struct WebServer::Impl {
  Impl(const WebOptions& web_options, WebSite& web_site)
      : options(web_options), site(web_site), acceptor(io) {}

  void Listen();
  void Accept();
  void SendToPeers();
  bool OriginKnown(const std::string& origin, const std::string& host) const;

  WebOptions options;
  WebSite& site;
  // That ask; first the one whose request or answer has been under way for longest. They live as
  // long as `io`.
  std::list<Connection*> connections;
  asio::io_context io{1};
  tcp::acceptor acceptor;
  std::list<std::weak_ptr<Socket>> sockets;
};

namespace {

// One connection that asks, until it wants to be a WebSocket.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, WebServer::Impl& server)
      : stream_(std::move(socket)),
        timer_(server.io),
        server_(server),
        place_(server.connections.insert(server.connections.end(), this)) {}
  ~Connection() { server_.connections.erase(place_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void Read() {
    parser_.emplace();
    parser_->header_limit(kMaxHeader);
    parser_->body_limit(WebServer::kMaxBody);
    BeginWithin(kAsking);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](beast::error_code error, size_t) {
                       if (!error) {
                         self->Take(self->parser_->release());
                       } else if (error == http::error::body_limit) {
                         self->RefuseBody();
                       }
                     });
  }

  // For another's sake. It goes once its handler has heard of it, and is not chosen until then.
  void Close() {
    asked_ = std::nullopt;
    timer_.cancel();
    stream_.close();
    server_.connections.splice(server_.connections.end(), server_.connections, place_);
  }

 private:
  // What the answer needs of its request.
  struct Asked {
    int64_t number = 0;
    unsigned version = 11;
    bool keep_alive = false;
    bool is_head = false;
    std::string page;  // the origin that the answer is for, if it is another's
  };

  void BeginWithin(std::chrono::seconds limit) {
    stream_.expires_after(limit);
    server_.connections.splice(server_.connections.end(), server_.connections, place_);
  }

  void Take(Request request) {
    const std::string host = Text(request[http::field::host]);
    const std::string origin = Text(request[http::field::origin]);
    const bool known = server_.OriginKnown(origin, host);
    asked_ = Asked{++number_, request.version(), request.keep_alive(),
                   request.method() == http::verb::head, known ? origin : ""};
    if (!HostAllowed(host, server_.options.names)) {
      asked_->page = "";
      Refuse(403, "This host name is not known here: --name NAME allows it.\n");
    } else if (server_.options.for_programs && !known && IsOfAPage(request)) {
      Refuse(403, "Pages of other origins may not ask: --allow-origin URL allows one.\n");
    } else if (websocket::is_upgrade(request)) {
      OpenSocket(std::move(request), known || (server_.options.for_programs && origin.empty()));
    } else if (server_.options.for_programs && request.method() == http::verb::options && known) {
      Send({204,
            "",
            "",
            {{"Access-Control-Allow-Methods", "GET, POST, PUT, DELETE"},
             {"Access-Control-Allow-Headers", "Content-Type, If-Match"},
             {"Access-Control-Max-Age", "600"}}});
    } else {
      Ask(ToWebRequest(std::move(request), host));
    }
  }

  // A browser names the origin, or, of what a page merely embeds, that it is another's.
  static bool IsOfAPage(const Request& request) {
    const std::string from = Text(request["Sec-Fetch-Site"]);
    return request.count(http::field::origin) > 0 || from == "cross-site" || from == "same-site";
  }

  static WebRequest ToWebRequest(Request request, const std::string& host) {
    const bool is_head = request.method() == http::verb::head;
    return {is_head ? "GET" : Text(request.method_string()), Text(request.target()), host,
            Text(request[http::field::if_match]), std::move(request.body())};
  }

  // The timer holds this connection until there is an answer.
  void Ask(const WebRequest& request) {
    const int64_t number = number_;
    timer_.expires_after(kAnswering);
    timer_.async_wait([self = shared_from_this(), number](beast::error_code error) {
      if (!error) {
        self->Answer(number, {503, "text/plain; charset=utf-8", "There is no answer yet.\n"});
      }
    });
    server_.site.Answer(request, [weak = weak_from_this(), number](WebAnswer answer) {
      if (const auto self = weak.lock()) {
        self->Answer(number, std::move(answer));
      }
    });
  }

  void Answer(int64_t number, WebAnswer answer) {
    if (asked_ && asked_->number == number) {
      timer_.cancel();
      Send(std::move(answer));
    }
  }

  void OpenSocket(Request request, bool allowed) {
    if (!allowed) {
      Refuse(403, "Only the page of this server may connect.\n");
    } else if (server_.sockets.size() >= WebServer::kMaxPeers) {
      Refuse(503, "Too many are connected.\n");
    } else if (auto peer =
                   server_.site.Open(ToWebRequest(request, Text(request[http::field::host])))) {
      stream_.expires_never();
      const auto socket = std::make_shared<Socket>(std::move(stream_), std::move(peer));
      server_.sockets.push_back(socket);
      socket->Open(std::move(request));
    } else {
      Refuse(404, "There is no WebSocket here.\n");
    }
  }

  // The rest of the body is not read, so nothing more can come on this connection.
  void RefuseBody() {
    asked_ = Asked{++number_, 11, false, false, ""};
    Refuse(413, fmt::format("The body has more than {} bytes.\n", WebServer::kMaxBody));
  }

  void Refuse(int status, const std::string& why) {
    Send({status, "text/plain; charset=utf-8", why});
  }

  void Send(WebAnswer answer) {
    const Asked asked = *std::exchange(asked_, std::nullopt);
    response_.emplace(static_cast<http::status>(answer.status), asked.version);
    if (!answer.type.empty()) {
      response_->set(http::field::content_type, answer.type);
    }
    response_->set(http::field::cache_control, "no-cache");
    response_->set("X-Content-Type-Options", "nosniff");
    response_->set("Content-Security-Policy", kNothing);
    if (!server_.options.origins.empty()) {
      response_->set(http::field::vary, "Origin");
    }
    if (!asked.page.empty() && std::ranges::count(server_.options.origins, asked.page) > 0) {
      response_->set(http::field::access_control_allow_origin, asked.page);
      response_->set(http::field::access_control_expose_headers, "ETag, Location");
    }
    for (const auto& [name, value] : answer.headers) {
      response_->set(name, value);
    }
    response_->keep_alive(asked.keep_alive);
    response_->body() = std::move(answer.body);
    response_->prepare_payload();
    if (asked.is_head) {
      response_->body().clear();
    }
    BeginWithin(kTaking);
    http::async_write(stream_, *response_,
                      [self = shared_from_this()](beast::error_code error, size_t) {
                        if (!error && self->response_->keep_alive()) {
                          self->Read();
                        }
                      });
  }

  beast::tcp_stream stream_;
  asio::steady_timer timer_;
  WebServer::Impl& server_;
  const std::list<Connection*>::iterator place_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  int64_t number_ = 0;          // requests so far
  std::optional<Asked> asked_;  // until it is answered
  std::optional<http::response<http::string_body>> response_;
};

}  // namespace

void WebServer::Impl::Listen() {
  beast::error_code error;
  const auto address = asio::ip::make_address(options.listen, error);
  if (error) {
    throw std::runtime_error(
        fmt::format("cannot listen on {}: it is not an address of this machine", options.listen));
  }
  const tcp::endpoint endpoint(address, options.port);
  acceptor.open(endpoint.protocol(), error);
  if (!error) {
    acceptor.set_option(asio::socket_base::reuse_address(true), error);
  }
  if (!error) {
    acceptor.bind(endpoint, error);
  }
  if (!error) {
    acceptor.listen(asio::socket_base::max_listen_connections, error);
  }
  if (error) {
    throw std::runtime_error(fmt::format("cannot listen on {} port {} ({}): give another port",
                                         options.listen, options.port, error.message()));
  }
}

void WebServer::Impl::Accept() {
  acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
    if (!error) {
      if (connections.size() >= kMaxConnections) {
        connections.front()->Close();
      }
      std::make_shared<Connection>(std::move(socket), *this)->Read();
    }
    if (error != asio::error::operation_aborted) {
      Accept();
    }
  });
}

void WebServer::Impl::SendToPeers() {
  sockets.remove_if([](const std::weak_ptr<Socket>& socket) { return socket.expired(); });
  for (const std::weak_ptr<Socket>& socket : sockets) {
    if (const auto alive = socket.lock()) {
      alive->SendNext();
    }
  }
}

bool WebServer::Impl::OriginKnown(const std::string& origin, const std::string& host) const {
  return OriginAllowed(origin, host) || std::ranges::count(options.origins, origin) > 0;
}

WebServer::WebServer(const WebOptions& options, WebSite& site)
    : impl_(std::make_unique<Impl>(options, site)) {
  for (const std::string& origin : options.origins) {
    if (!IsOrigin(origin)) {
      throw std::runtime_error(fmt::format(
          "--allow-origin {}: give scheme and host alone, as https://app.example", origin));
    }
  }
  impl_->Listen();
  impl_->Accept();
}

WebServer::~WebServer() = default;

uint16_t WebServer::port() const { return impl_->acceptor.local_endpoint().port(); }

void WebServer::Serve(int timeout_ms) {
  impl_->SendToPeers();
  impl_->io.restart();
  if (timeout_ms > 0) {
    impl_->io.run_for(std::chrono::milliseconds(timeout_ms));
  } else {
    impl_->io.poll();
  }
}

}  // namespace pangea::web

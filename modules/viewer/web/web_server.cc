#include "viewer/web/web_server.h"

#include <fmt/format.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <list>
#include <optional>
#include <stdexcept>
#include <utility>

#include "viewer/web/page_link.h"

namespace pangea::viewer {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using Request = http::request<http::empty_body>;

constexpr uint32_t kMaxHeader = 8192;
constexpr std::chrono::seconds kSilence{30};

std::string Text(boost::beast::string_view text) { return {text.data(), text.size()}; }

// A browser that shows the page.
class Browser : public std::enable_shared_from_this<Browser> {
 public:
  Browser(beast::tcp_stream stream, Show& show) : socket_(std::move(stream)), link_(show) {}

  void Open(Request request) {
    auto timeout = websocket::stream_base::timeout::suggested(beast::role_type::server);
    timeout.idle_timeout = kSilence;
    socket_.set_option(timeout);
    socket_.read_message_max(PageLink::kMaxText);
    socket_.binary(true);
    request_ = std::move(request);
    socket_.async_accept(request_, [self = shared_from_this()](beast::error_code error) {
      self->open_ = !error;
      if (!error) {
        self->Read();
      }
    });
  }

  void SendUpdate() {
    if (!open_ || sending_) {
      return;
    }
    auto update = link_.Next();
    if (!update) {
      return;
    }
    update_ = std::move(*update);
    sending_ = true;
    socket_.async_write(asio::buffer(update_),
                        [self = shared_from_this()](beast::error_code error, size_t) {
                          self->sending_ = false;
                          self->open_ = self->open_ && !error;
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
          self->link_.Receive({static_cast<const char*>(data.data()), data.size()});
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
  PageLink link_;
  Request request_;
  beast::flat_buffer buffer_;
  std::vector<uint8_t> update_;
  bool open_ = false;
  bool sending_ = false;
};

}  // namespace

struct WebServer::Impl {
  Impl(const WebOptions& web_options, std::map<std::string, PageFile> files, Show& shown)
      : options(web_options), page(std::move(files)), show(shown), acceptor(io) {}

  void Listen();
  void Accept();
  void SendUpdate();

  WebOptions options;
  std::map<std::string, PageFile> page;
  Show& show;
  asio::io_context io{1};
  tcp::acceptor acceptor;
  int num_connections = 0;
  std::list<std::weak_ptr<Browser>> browsers;
};

namespace {

// One connection that asks for files, until it wants to be a WebSocket.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, WebServer::Impl& server)
      : stream_(std::move(socket)), server_(server) {
    ++server_.num_connections;
  }
  ~Connection() { --server_.num_connections; }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void Read() {
    parser_.emplace();
    parser_->header_limit(kMaxHeader);
    stream_.expires_after(kSilence);
    http::async_read(stream_, buffer_, *parser_,
                     [self = shared_from_this()](beast::error_code error, size_t) {
                       if (!error) {
                         self->Answer(self->parser_->release());
                       }
                     });
  }

 private:
  void Answer(Request request) {
    const std::string host = Text(request[http::field::host]);
    if (!HostAllowed(host, server_.options.names)) {
      Refuse(request, http::status::forbidden,
             "This host name is not known here: pangea-viewer --name NAME allows it.\n");
    } else if (websocket::is_upgrade(request)) {
      OpenBrowser(std::move(request), host);
    } else if (request.method() != http::verb::get && request.method() != http::verb::head) {
      Refuse(request, http::status::method_not_allowed, "Only GET and HEAD.\n");
    } else {
      const auto file = server_.page.find(Text(request.target()));
      if (file == server_.page.end()) {
        Refuse(request, http::status::not_found, "There is no such file.\n");
      } else {
        Send(request, http::status::ok, file->second);
      }
    }
  }

  void OpenBrowser(Request request, const std::string& host) {
    if (!OriginAllowed(Text(request[http::field::origin]), host)) {
      Refuse(request, http::status::forbidden, "Only the page of this server may connect.\n");
    } else if (server_.browsers.size() >= WebServer::kMaxBrowsers) {
      Refuse(request, http::status::service_unavailable, "Too many browsers are connected.\n");
    } else {
      stream_.expires_never();
      const auto browser = std::make_shared<Browser>(std::move(stream_), server_.show);
      server_.browsers.push_back(browser);
      browser->Open(std::move(request));
    }
  }

  void Refuse(const Request& request, http::status status, const std::string& why) {
    Send(request, status, {"text/plain; charset=utf-8", why});
  }

  void Send(const Request& request, http::status status, const PageFile& file) {
    response_.emplace(status, request.version());
    response_->set(http::field::content_type, file.type);
    response_->set(http::field::cache_control, "no-cache");
    response_->set("X-Content-Type-Options", "nosniff");
    response_->set("Content-Security-Policy",
                   fmt::format("default-src 'self'; connect-src 'self' ws://{0} wss://{0}; "
                               "img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; "
                               "frame-ancestors 'none'",
                               Text(request[http::field::host])));
    response_->keep_alive(request.keep_alive());
    response_->body() = file.body;
    response_->prepare_payload();
    if (request.method() == http::verb::head) {
      response_->body().clear();
    }
    http::async_write(stream_, *response_,
                      [self = shared_from_this()](beast::error_code error, size_t) {
                        if (!error && self->response_->keep_alive()) {
                          self->Read();
                        }
                      });
  }

  beast::tcp_stream stream_;
  WebServer::Impl& server_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<http::response<http::string_body>> response_;
};

}  // namespace

void WebServer::Impl::Listen() {
  beast::error_code error;
  const auto address = asio::ip::make_address(options.listen, error);
  if (error) {
    throw std::runtime_error(
        fmt::format("--listen {}: is not an address of this machine", options.listen));
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
    throw std::runtime_error(fmt::format("cannot listen on {} port {} ({}): give another --port",
                                         options.listen, options.port, error.message()));
  }
}

void WebServer::Impl::Accept() {
  acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
    if (!error && num_connections < kMaxConnections) {
      std::make_shared<Connection>(std::move(socket), *this)->Read();
    }
    if (error != asio::error::operation_aborted) {
      Accept();
    }
  });
}

void WebServer::Impl::SendUpdate() {
  browsers.remove_if([](const std::weak_ptr<Browser>& browser) { return browser.expired(); });
  for (const std::weak_ptr<Browser>& browser : browsers) {
    if (const auto alive = browser.lock()) {
      alive->SendUpdate();
    }
  }
}

WebServer::WebServer(const WebOptions& options, std::map<std::string, PageFile> page, Show& show)
    : impl_(std::make_unique<Impl>(options, std::move(page), show)) {
  impl_->Listen();
  impl_->Accept();
}

WebServer::~WebServer() = default;

uint16_t WebServer::port() const { return impl_->acceptor.local_endpoint().port(); }

void WebServer::Serve(int timeout_ms) {
  impl_->SendUpdate();
  impl_->io.restart();
  impl_->io.run_for(std::chrono::milliseconds(timeout_ms));
}

}  // namespace pangea::viewer

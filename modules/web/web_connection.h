#pragma once

// One HTTP connection, with or without TLS, until it becomes a WebSocket.

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/http/span_body.hpp>
#include <utility>

#include "web/web_rules.h"
#include "web/web_socket.h"

namespace pangea::web {

template <typename Stream>
class Connection : public AnyConnection, public std::enable_shared_from_this<Connection<Stream>> {
 public:
  Connection(Stream stream, ServerState& server)
      : stream_(std::move(stream)),
        timer_(server.io),
        server_(server),
        place_(server.connections.insert(server.connections.end(), this)) {
    beast::error_code gone;
    const auto remote = tcp_stream().socket().remote_endpoint(gone);
    address_ = gone ? "" : remote.address().to_string();
  }
  ~Connection() override { server_.connections.erase(place_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void Begin() {
    if constexpr (kIsTls<Stream>) {
      BeginWithin(kAsking);
      stream_.async_handshake(asio::ssl::stream_base::server,
                              [self = this->shared_from_this()](beast::error_code error) {
                                if (error) {
                                  self->Note("TLS handshake: " + error.message());
                                } else {
                                  self->Read();
                                }
                              });
    } else {
      Read();
    }
  }

  // Called to make room for another connection. This object lives until its pending handler has
  // run; it moves to the end of the list, so that it is not chosen again.
  void Close() override {
    asked_ = std::nullopt;
    timer_.cancel();
    tcp_stream().close();
    server_.connections.splice(server_.connections.end(), server_.connections, place_);
  }

 private:
  // The properties of a request that its answer needs.
  struct Asked {
    int64_t number = 0;
    unsigned version = 11;
    bool keep_alive = false;
    bool is_head = false;
    std::string page;  // the request's Origin, if it is known and allowed
  };

  beast::tcp_stream& tcp_stream() { return beast::get_lowest_layer(stream_); }

  void BeginWithin(std::chrono::seconds limit) {
    tcp_stream().expires_after(limit);
    server_.connections.splice(server_.connections.end(), server_.connections, place_);
  }

  void Read() {
    parser_.emplace();
    parser_->header_limit(kMaxHeader);
    parser_->body_limit(WebServer::kMaxBody);
    BeginWithin(kAsking);
    http::async_read(stream_, buffer_, *parser_,
                     [self = this->shared_from_this()](beast::error_code error, size_t) {
                       if (!error) {
                         self->Take(self->parser_->release());
                       } else {
                         self->OnReadError(error);
                       }
                     });
  }

  // The end of the connection between two requests is not an error.
  void OnReadError(beast::error_code error) {
    if (error == http::error::body_limit) {
      RefuseUnread(413, fmt::format("The body has more than {} bytes.", WebServer::kMaxBody));
    } else if (error == http::error::header_limit || error == http::error::buffer_overflow) {
      const bool has_target = !parser_->get().target().empty();
      RefuseUnread(has_target ? 431 : 414,
                   fmt::format("The {} too long: URL and headers may have {} bytes.",
                               has_target ? "headers are" : "URL is", kMaxHeader));
    } else if (error == beast::error::timeout && parser_->got_some()) {
      Note("request: it takes too long");
    } else if (error != http::error::end_of_stream &&
               error.category() == make_error_code(http::error::bad_method).category()) {
      RefuseUnread(400, fmt::format("This is no HTTP: {}.", error.message()));
    }
  }

  void Take(Request request) {
    const std::string host = Text(request[http::field::host]);
    const std::string origin = Text(request[http::field::origin]);
    const bool known = OriginKnown(origin, host);
    asked_ = Asked{++number_, request.version(), request.keep_alive(),
                   request.method() == http::verb::head, known ? origin : ""};
    if (!HostAllowed(host, server_.options.names)) {
      asked_->page = "";
      Refuse(403, "This host name is not known here: the server's command line can allow it.");
    } else if (server_.options.for_programs && !known && IsOfAPage(request)) {
      Refuse(403, "Pages of other origins may not ask: --allow-origin URL allows one.");
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

  bool OriginKnown(const std::string& origin, const std::string& host) const {
    return OriginAllowed(origin, host) || std::ranges::count(server_.options.origins, origin) > 0;
  }

  // Whether a web page of another origin made the request. A browser sends an Origin header, or
  // Sec-Fetch-Site for what a page embeds. A followed link does not count: it leaves the page.
  static bool IsOfAPage(const Request& request) {
    const std::string from = Text(request["Sec-Fetch-Site"]);
    const bool follows_link =
        request.method() == http::verb::get && Text(request["Sec-Fetch-Dest"]) == "document";
    return request.count(http::field::origin) > 0 ||
           ((from == "cross-site" || from == "same-site") && !follows_link);
  }

  WebRequest ToWebRequest(Request request, const std::string& host) const {
    const bool is_head = request.method() == http::verb::head;
    const bool takes_gzip =
        Text(request[http::field::accept_encoding]).find("gzip") != std::string::npos;
    return {is_head ? "GET" : Text(request.method_string()),
            Text(request.target()),
            host,
            Text(request[http::field::if_match]),
            std::move(request.body()),
            address_,
            takes_gzip};
  }

  // Passes the request to the site. The timer keeps this connection alive until there is an answer.
  void Ask(const WebRequest& request) {
    const int64_t number = number_;
    timer_.expires_after(kAnswering);
    timer_.async_wait([self = this->shared_from_this(), number](beast::error_code error) {
      if (!error) {
        self->Answer(number, self->Refusal(503, "There is no answer yet."));
      }
    });
    server_.site.Answer(request, [weak = this->weak_from_this(), number](WebAnswer answer) {
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
      Refuse(403, "Only the page of this server may connect.");
    } else if (server_.sockets.size() >= static_cast<size_t>(server_.options.max_peers)) {
      Refuse(503, "Too many are connected.");
    } else if (auto peer =
                   server_.site.Open(ToWebRequest(request, Text(request[http::field::host])))) {
      tcp_stream().expires_never();
      const auto socket =
          std::make_shared<Socket<Stream>>(std::move(stream_), std::move(peer), server_.site);
      server_.sockets.push_back(socket);
      socket->Open(std::move(request));
    } else {
      Refuse(404, "There is no WebSocket here.");
    }
  }

  // Refuses a request without reading the rest of it; so the connection cannot be used any more.
  void RefuseUnread(int status, const std::string& why) {
    asked_ = Asked{++number_, 11, false, false, ""};
    has_unread_ = true;
    Refuse(status, why);
  }

  void Refuse(int status, const std::string& why) {
    Note("request: " + why.substr(0, why.find_first_of(":.")));
    Send(Refusal(status, why));
  }

  // An error in the format of the site's own errors. `why` must need no escapes in JSON.
  WebAnswer Refusal(int status, const std::string& why) const {
    if (server_.options.for_programs) {
      return {status, "application/json", fmt::format("{{\"error\":\"{}\"}}\n", why)};
    }
    return {status, "text/plain; charset=utf-8", why + "\n"};
  }

  // Reads and discards the rest of the request: closing the connection while the client still sends
  // would reset it, and the client might not get the answer.
  void EndUnread() {
    beast::error_code gone;
    tcp_stream().socket().shutdown(tcp::socket::shutdown_send, gone);
    BeginWithin(kAsking);
    Discard();
  }

  void Discard(size_t discarded = 0) {
    constexpr size_t kMost = 4 << 20;
    buffer_.clear();
    tcp_stream().async_read_some(
        buffer_.prepare(kMaxHeader),
        [self = this->shared_from_this(), discarded](beast::error_code error, size_t size) {
          if (!error && discarded + size < kMost) {
            self->Discard(discarded + size);
          }
        });
  }

  void Note(const std::string& why) { server_.site.Refused(why); }

  void Send(WebAnswer answer) {
    const Asked asked = *std::exchange(asked_, std::nullopt);
    answer_ = std::move(answer);
    response_.emplace(static_cast<http::status>(answer_.status), asked.version);
    if (!answer_.type.empty()) {
      response_->set(http::field::content_type, answer_.type);
    }
    response_->set(http::field::cache_control, "no-cache");
    response_->set("X-Content-Type-Options", "nosniff");
    response_->set("Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'");
    if (!server_.options.origins.empty()) {
      response_->set(http::field::vary, "Origin");
    }
    if (!asked.page.empty() && std::ranges::count(server_.options.origins, asked.page) > 0) {
      response_->set(http::field::access_control_allow_origin, asked.page);
      response_->set(http::field::access_control_expose_headers, "ETag, Location");
    }
    for (const auto& [name, value] : answer_.headers) {
      response_->set(name, value);
    }
    response_->keep_alive(asked.keep_alive);
    const std::string& body = answer_.file ? *answer_.file : answer_.body;
    response_->body() = {body.data(), body.size()};
    response_->prepare_payload();
    if (asked.is_head) {
      response_->body() = {};
    }
    BeginWithin(kTaking);
    http::async_write(stream_, *response_,
                      [self = this->shared_from_this()](beast::error_code error, size_t) {
                        if (!error && self->response_->keep_alive()) {
                          self->Read();
                        } else if (!error && self->has_unread_) {
                          self->EndUnread();
                        }
                      });
  }

  static std::string Text(beast::string_view text) { return {text.data(), text.size()}; }

  Stream stream_;
  asio::steady_timer timer_;
  ServerState& server_;
  const std::list<AnyConnection*>::iterator place_;
  std::string address_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  int64_t number_ = 0;          // requests so far
  std::optional<Asked> asked_;  // until it is answered
  bool has_unread_ = false;     // the rest of the last request was not read
  WebAnswer answer_;            // the response points into it
  std::optional<http::response<http::span_body<const char>>> response_;
};

}  // namespace pangea::web

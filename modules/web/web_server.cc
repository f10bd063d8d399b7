#include "web/web_server.h"

#include <fmt/format.h>
#include <openssl/ssl.h>

#include <boost/asio/ip/v6_only.hpp>
#include <chrono>
#include <stdexcept>

#include "web/web_connection.h"

namespace pangea::web {
namespace {

constexpr std::chrono::milliseconds kAcceptRetry{100};

asio::ssl::context ContextOf(const TlsIdentity& identity) {
  asio::ssl::context tls(asio::ssl::context::tls_server);
  SSL_CTX_set_min_proto_version(tls.native_handle(), TLS1_2_VERSION);
  // Our clients neither renegotiate nor resume sessions. Idle connections release their buffers.
  tls.set_options(SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_TICKET);
  SSL_CTX_set_session_cache_mode(tls.native_handle(), SSL_SESS_CACHE_OFF);
  SSL_CTX_set_mode(tls.native_handle(), SSL_MODE_RELEASE_BUFFERS);
  beast::error_code error;
  tls.use_certificate_chain(asio::buffer(identity.certificate_chain_pem), error);
  if (!error) {
    tls.use_private_key(asio::buffer(identity.private_key_pem), asio::ssl::context::pem, error);
  }
  if (error) {
    throw std::runtime_error(fmt::format(
        "the certificate and its key cannot be used ({}): both must be PEM, of one pair, the "
        "server's own certificate first",
        error.message()));
  }
  return tls;
}

}  // namespace

struct WebServer::Impl : ServerState {
  Impl(const WebOptions& web_options, WebSite& web_site)
      : ServerState(web_options, web_site), acceptor(io), retry(io) {}

  void Listen();
  void Accept();
  void AcceptLater();
  void Welcome(tcp::socket socket);
  void SendToPeers();

  std::optional<asio::ssl::context> tls;  // of further connections; each keeps its own
  tcp::acceptor acceptor;
  asio::steady_timer retry;
};

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
  if (!error && address.is_v6() && address.is_unspecified()) {
    acceptor.set_option(asio::ip::v6_only(false), error);  // IPv4 too, also where a sysctl says no
  }
  if (!error) {
    acceptor.bind(endpoint, error);
  }
  if (!error) {
    acceptor.listen(asio::socket_base::max_listen_connections, error);
  }
  if (error) {
    const bool is_foreign = error == boost::system::errc::address_not_available;
    throw std::runtime_error(
        fmt::format("cannot listen on {} port {} ({}): give {}", options.listen, options.port,
                    error.message(), is_foreign ? "an address of this machine" : "another port"));
  }
}

void WebServer::Impl::Accept() {
  acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
    if (!error) {
      Welcome(std::move(socket));
    }
    if (!error) {
      Accept();
    } else if (error != asio::error::operation_aborted) {
      AcceptLater();
    }
  });
}

// Without a free file descriptor each attempt fails at once.
void WebServer::Impl::AcceptLater() {
  retry.expires_after(kAcceptRetry);
  retry.async_wait([this](beast::error_code error) {
    if (!error) {
      Accept();
    }
  });
}

void WebServer::Impl::Welcome(tcp::socket socket) {
  if (connections.size() >= kMaxConnections) {
    connections.front()->Close();
  }
  if (tls) {
    TlsStream stream(std::move(socket), *tls);
    std::make_shared<Connection<TlsStream>>(std::move(stream), *this)->Begin();
  } else {
    std::make_shared<Connection<PlainStream>>(PlainStream(std::move(socket)), *this)->Begin();
  }
}

void WebServer::Impl::SendToPeers() {
  sockets.remove_if([](const std::weak_ptr<AnySocket>& socket) { return socket.expired(); });
  for (const std::weak_ptr<AnySocket>& socket : sockets) {
    if (const auto alive = socket.lock()) {
      alive->SendNext();
    }
  }
}

WebServer::WebServer(const WebOptions& options, WebSite& site)
    : impl_(std::make_unique<Impl>(options, site)) {
  CheckOrigins(options.origins);
  if (options.tls) {
    UseIdentity(*options.tls);
  }
  impl_->Listen();
  impl_->Accept();
}

WebServer::~WebServer() = default;

uint16_t WebServer::port() const { return impl_->acceptor.local_endpoint().port(); }

void WebServer::UseIdentity(const TlsIdentity& identity) { impl_->tls = ContextOf(identity); }

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

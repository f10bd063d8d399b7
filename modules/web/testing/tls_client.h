#pragma once

// For tests of web servers: a WebClient over TLS, and parsing of the WebSocket frames that a server
// sent. No call blocks, so a server on the same thread can run between the calls.

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace pangea::web {

class TlsClient {
 public:
  // With a certificate, the client trusts only this authority, and only for 127.0.0.1. Without one,
  // it trusts any server.
  explicit TlsClient(uint16_t port, const std::string& authority_pem = "")
      : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)),
        context_(SSL_CTX_new(TLS_client_method()), SSL_CTX_free) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(fcntl(fd_, F_SETFL, O_NONBLOCK), 0);
    if (!authority_pem.empty()) {
      Trust(authority_pem);
    }
    ssl_.reset(SSL_new(context_.get()));
    if (!authority_pem.empty()) {
      X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl_.get()), "127.0.0.1");
    }
    std::signal(SIGPIPE,
                SIG_IGN);  // OpenSSL writes to a server that was killed without MSG_NOSIGNAL
    SSL_set_fd(ssl_.get(), fd_);
    SSL_set_connect_state(ssl_.get());
    Pump();
  }
  ~TlsClient() {
    ssl_.reset();
    close(fd_);
  }
  TlsClient(const TlsClient&) = delete;
  TlsClient& operator=(const TlsClient&) = delete;

  void Send(std::string_view bytes) {
    to_send_ += bytes;
    Pump();
  }
  // The bytes received since the last call.
  std::string Received() {
    Pump();
    return std::exchange(received_, {});
  }
  bool closed() {
    Pump();
    return closed_;
  }
  bool shook_hands() {
    Pump();
    return SSL_is_init_finished(ssl_.get()) == 1;
  }

  // The server's certificate as PEM; empty before the handshake.
  std::string certificate() {
    Pump();
    const std::unique_ptr<X509, void (*)(X509*)> certificate(SSL_get1_peer_certificate(ssl_.get()),
                                                             X509_free);
    const std::unique_ptr<BIO, void (*)(BIO*)> memory(BIO_new(BIO_s_mem()), BIO_free_all);
    if (certificate == nullptr || PEM_write_bio_X509(memory.get(), certificate.get()) != 1) {
      return "";
    }
    char* data = nullptr;
    const long size = BIO_get_mem_data(memory.get(), &data);
    return {data, static_cast<size_t>(size)};
  }

 private:
  void Trust(const std::string& authority_pem) {
    BIO* const memory =
        BIO_new_mem_buf(authority_pem.data(), static_cast<int>(authority_pem.size()));
    X509* const authority = PEM_read_bio_X509(memory, nullptr, nullptr, nullptr);
    X509_STORE_add_cert(SSL_CTX_get_cert_store(context_.get()), authority);
    X509_free(authority);
    BIO_free(memory);
    SSL_CTX_set_verify(context_.get(), SSL_VERIFY_PEER, nullptr);
  }

  void Pump() {
    ERR_clear_error();  // the error queue is the thread's: another client may have left errors
    if (closed_ || !Done(SSL_do_handshake(ssl_.get()))) {
      return;
    }
    while (!to_send_.empty()) {
      const int n = SSL_write(ssl_.get(), to_send_.data(),
                              static_cast<int>(std::min<size_t>(to_send_.size(), 16384)));
      if (!Done(n)) {
        break;
      }
      to_send_.erase(0, static_cast<size_t>(n));
    }
    char bytes[16384];
    for (;;) {
      const int n = SSL_read(ssl_.get(), bytes, sizeof(bytes));
      if (!Done(n)) {
        return;
      }
      received_.append(bytes, static_cast<size_t>(n));
    }
  }

  bool Done(int result) {
    if (result > 0) {
      return true;
    }
    const int error = SSL_get_error(ssl_.get(), result);
    closed_ = closed_ || (error != SSL_ERROR_WANT_READ && error != SSL_ERROR_WANT_WRITE);
    return false;
  }

  const int fd_;
  std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)> context_;
  std::unique_ptr<SSL, void (*)(SSL*)> ssl_{nullptr, SSL_free};
  std::string to_send_, received_;
  bool closed_ = false;
};

// A frame that a server sent.
struct Frame {
  static constexpr int kBinary = 2;
  static constexpr int kClose = 8;  // its payload: two bytes of code, then the reason
  int opcode = 0;
  std::string payload;
};
// Removes the complete frames from the front of `received` and returns them.
inline std::vector<Frame> TakeFrames(std::string* received) {
  std::vector<Frame> frames;
  const auto byte = [&](size_t at) { return static_cast<uint8_t>((*received)[at]); };
  while (received->size() >= 2) {
    size_t size = byte(1) & 0x7f;
    size_t header = 2;
    if (size == 126 && received->size() >= 4) {
      size = byte(2) << 8 | byte(3);
      header = 4;
    }
    if (size > 65535 || received->size() < header + size) {
      break;
    }
    frames.push_back({byte(0) & 0x0f, received->substr(header, size)});
    received->erase(0, header + size);
  }
  return frames;
}

}  // namespace pangea::web

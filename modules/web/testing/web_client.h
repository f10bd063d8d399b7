#pragma once

// For tests of web servers: a connection on which a test plays the browser.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <string>

#include "web/web_server.h"

namespace pangea::web {

class WebClient {
 public:
  explicit WebClient(uint16_t port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  }
  ~WebClient() { close(fd_); }
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;

  void Send(const std::string& text) { send(fd_, text.data(), text.size(), MSG_NOSIGNAL); }

  // The bytes received so far; `closed` becomes whether the server closed the connection.
  std::string Received(bool* closed = nullptr) {
    std::string all;
    char bytes[65536];
    for (;;) {
      const ssize_t n = recv(fd_, bytes, sizeof(bytes), MSG_DONTWAIT);
      if (n <= 0) {
        if (closed != nullptr) {
          *closed = n == 0 || errno == ECONNRESET;
        }
        return all;
      }
      all.append(bytes, static_cast<size_t>(n));
    }
  }

 private:
  int fd_;
};

// Runs the server in the test's thread, long enough to take a request and answer it.
inline void ServeSome(WebServer* server) {
  for (int i = 0; i < 5; ++i) {
    server->Serve(10);
  }
}

// Sends a request on a new connection and returns the server's whole answer.
inline std::string Ask(WebServer* server, const std::string& request) {
  WebClient client(server->port());
  client.Send(request);
  ServeSome(server);
  return client.Received();
}

// A request for a WebSocket; `origin`: the value of its Origin header; empty: no such header.
inline std::string UpgradeRequest(const std::string& target, const std::string& origin) {
  return "GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1:1\r\n" +
         (origin.empty() ? "" : "Origin: " + origin + "\r\n") +
         "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
}

// A frame as a browser sends it, masked (here with zeros): text, or binary with opcode 2.
inline std::string MaskedFrame(const std::string& text, char opcode = 1) {
  std::string frame(1, static_cast<char>(0x80 | opcode));
  if (text.size() < 126) {
    frame += static_cast<char>(0x80 | text.size());
  } else {
    frame += '\xfe';
    frame += static_cast<char>(text.size() >> 8);
    frame += static_cast<char>(text.size() & 0xff);
  }
  return frame + std::string(4, '\0') + text;
}

}  // namespace pangea::web

#include "viewer/web/web_server.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "viewer/viewer_test_world.h"
#include "viewer/web/page_link.h"

namespace pangea::viewer {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

TEST(WebRules, HostsThatAreThisMachine) {
  const std::vector<std::string> names = {"robot.local"};
  for (const char* host : {"localhost", "localhost:8080", "127.0.0.1:8080", "192.168.1.7", "[::1]",
                           "[::1]:8080", "robot.local:8080"}) {
    EXPECT_TRUE(HostAllowed(host, names)) << host;
  }
  for (const char* host :
       {"", "evil.example", "evil.example:8080", "127.0.0.1.evil.example",
        "localhost.evil.example:8080", "[evil]:1", ":8080", "robot.local.evil"}) {
    EXPECT_FALSE(HostAllowed(host, names)) << host;
  }
  for (const char* port : {"", "0", "65536", "99999999999999999999", "-1", "+1", " 1", "1 ", "0x50",
                           "80;script-src *", "80 https://evil.example", "*"}) {
    for (const char* host : {"localhost:", "127.0.0.1:", "[::1]:", "robot.local:"}) {
      EXPECT_FALSE(HostAllowed(std::string(host) + port, names)) << host << port;
    }
  }
}

TEST(WebRules, OriginsThatAreThisServer) {
  EXPECT_TRUE(OriginAllowed("http://127.0.0.1:8080", "127.0.0.1:8080"));
  EXPECT_TRUE(OriginAllowed("https://robot.local", "robot.local"));
  for (const char* origin : {"", "null", "http://evil.example", "http://127.0.0.1:8081",
                             "http://127.0.0.1", "file://127.0.0.1:8080"}) {
    EXPECT_FALSE(OriginAllowed(origin, "127.0.0.1:8080")) << origin;
  }
  EXPECT_FALSE(OriginAllowed("http://", ""));
}

TEST(WebRules, APageIsReadOnceAndNothingElse) {
  const std::filesystem::path folder = testing::TempDir() + "/viewer_page";
  std::filesystem::create_directories(folder / "assets");
  std::ofstream(folder / "index.html") << "<p>";
  std::ofstream(folder / "assets" / "a.js") << "1";
  const auto page = ReadPage(folder);
  EXPECT_EQ(page.at("/").body, "<p>");
  EXPECT_EQ(page.at("/assets/a.js").type, "text/javascript; charset=utf-8");
  EXPECT_EQ(page.size(), 3U);
  EXPECT_THROW(ReadPage(folder / "assets"), std::runtime_error);
}

// A connection of a browser that a test writes by hand.
class Client {
 public:
  explicit Client(uint16_t port) : fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  }
  ~Client() { close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void Send(const std::string& text) { send(fd_, text.data(), text.size(), MSG_NOSIGNAL); }

  // What has come; `closed` when the server hung up.
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

class WebServerTest : public testing::Test {
 protected:
  void Serve() {
    for (int i = 0; i < 5; ++i) {
      server_.Serve(10);
    }
  }

  std::string Ask(const std::string& request) {
    Client client(server_.port());
    client.Send(request);
    Serve();
    return client.Received();
  }

  std::string Upgrade(const std::string& origin) const {
    return "GET / HTTP/1.1\r\nHost: 127.0.0.1:1\r\nOrigin: " + origin +
           "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
           "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
  }

  // A text frame as a browser masks it, here with zeros.
  static std::string Frame(const std::string& text) {
    std::string frame = "\x81";
    if (text.size() < 126) {
      frame += static_cast<char>(0x80 | text.size());
    } else {
      frame += '\xfe';
      frame += static_cast<char>(text.size() >> 8);
      frame += static_cast<char>(text.size() & 0xff);
    }
    return frame + std::string(4, '\0') + text;
  }

  TestShow show_;
  WebServer server_{{"127.0.0.1", 0, {}}, {{"/", {"text/html; charset=utf-8", "<p>page"}}}, show_};
};

TEST_F(WebServerTest, GivesOutThePageWithItsPolicy) {
  const std::string answer = Ask("GET / HTTP/1.1\r\nHost: localhost:1\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200 OK"));
  EXPECT_THAT(answer, HasSubstr("<p>page"));
  EXPECT_THAT(answer, HasSubstr("Content-Security-Policy: default-src 'self'"));
}

TEST_F(WebServerTest, RefusesWhatIsNotThere) {
  for (const char* target : {"/etc/passwd", "/../../etc/passwd", "/%2e%2e/x", "//", "*"}) {
    EXPECT_THAT(Ask(std::string("GET ") + target + " HTTP/1.1\r\nHost: localhost\r\n\r\n"),
                StartsWith("HTTP/1.1 404"))
        << target;
  }
  EXPECT_THAT(Ask("DELETE / HTTP/1.1\r\nHost: localhost\r\n\r\n"), StartsWith("HTTP/1.1 405"));
}

TEST_F(WebServerTest, RefusesNamesThatAreNotItsOwn) {
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n"), StartsWith("HTTP/1.1 403"));
}

TEST_F(WebServerTest, OnlyItsOwnPageMayConnect) {
  EXPECT_THAT(Ask(Upgrade("http://evil.example")), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(Ask(Upgrade("null")), StartsWith("HTTP/1.1 403"));
  const std::string answer = Ask(Upgrade("http://127.0.0.1:1"));
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 101"));
  EXPECT_THAT(answer, HasSubstr("\"source\":\"test\""));
}

TEST_F(WebServerTest, WhatNoPageSaysEndsTheConversation) {
  for (const std::string& text :
       {std::string("nonsense"), std::string(PageLink::kMaxText + 1, ' ')}) {
    Client client(server_.port());
    client.Send(Upgrade("http://127.0.0.1:1"));
    Serve();
    EXPECT_THAT(client.Received(), StartsWith("HTTP/1.1 101"));
    client.Send(Frame(R"({"play": false})"));
    Serve();
    EXPECT_FALSE(show_.clock().playing);
    bool closed = false;
    client.Send(Frame(text));
    Serve();
    // The closing handshake: its frame begins with 0x88.
    EXPECT_THAT(client.Received(&closed), HasSubstr("\x88"));
    show_.Play(true);
  }
}

TEST_F(WebServerTest, BrowsersAreCounted) {
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i <= WebServer::kMaxBrowsers; ++i) {
    clients.push_back(std::make_unique<Client>(server_.port()));
    clients.back()->Send(Upgrade("http://127.0.0.1:1"));
    Serve();
    EXPECT_THAT(clients.back()->Received(),
                StartsWith(i < WebServer::kMaxBrowsers ? "HTTP/1.1 101" : "HTTP/1.1 503"));
  }
  clients.clear();
  Serve();
  EXPECT_THAT(Ask(Upgrade("http://127.0.0.1:1")), StartsWith("HTTP/1.1 101"));
}

// The policy header names the host the request was for: what it says there is read first.
TEST_F(WebServerTest, NothingOfAHeaderGetsIntoThePolicy) {
  const std::string answer =
      Ask("GET / HTTP/1.1\r\nHost: localhost:80; script-src https://evil.example\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(answer, testing::Not(HasSubstr("evil")));
}

// Nobody locks the viewer by opening connections and saying nothing, or half a request, or by
// leaving the answer where it is.
TEST_F(WebServerTest, ANewConnectionTakesTheOldestsPlace) {
  const char* const said[] = {"", "GET / HT", "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"};
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < 2 * WebServer::kMaxConnections; ++i) {
    clients.push_back(std::make_unique<Client>(server_.port()));
    clients.back()->Send(said[i % 3]);
    server_.Serve(1);
  }
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"), HasSubstr("<p>page"));
  const auto closed = std::ranges::count_if(clients, [](const auto& client) {
    bool is_closed = false;
    client->Received(&is_closed);
    return is_closed;
  });
  EXPECT_EQ(closed, WebServer::kMaxConnections + 1);
  bool newest_closed = false;
  clients.back()->Received(&newest_closed);
  EXPECT_FALSE(newest_closed);
}

TEST_F(WebServerTest, ALongRequestEndsTheConnection) {
  Client client(server_.port());
  client.Send("GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(100'000, 'x') + "\r\n\r\n");
  Serve();
  bool closed = false;
  EXPECT_EQ(client.Received(&closed), "");
  EXPECT_TRUE(closed);
}

TEST(WebServer, SaysWhatIsWrongWithItsAddress) {
  TestShow show;
  WebServer first({"127.0.0.1", 0, {}}, {}, show);
  EXPECT_THROW(WebServer({"127.0.0.1", first.port(), {}}, {}, show), std::runtime_error);
  EXPECT_THROW(WebServer({"nowhere", 0, {}}, {}, show), std::runtime_error);
}

}  // namespace
}  // namespace pangea::viewer

#include "web/web_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <memory>
#include <stdexcept>
#include <string>

#include "web/testing/web_client.h"

namespace pangea::web {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class TestPeer : public WebPeer {
 public:
  explicit TestPeer(int* to_send) : to_send_(to_send) {}
  bool is_text() const override { return true; }
  std::optional<std::vector<uint8_t>> Next() override {
    if (*to_send_ == 0) {
      return std::nullopt;
    }
    const std::string text = "message " + std::to_string((*to_send_)--);
    return std::vector<uint8_t>(text.begin(), text.end());
  }
  bool Receive(std::string_view text) override { return text == "good"; }

 private:
  int* const to_send_;
};

// Answers "/" at once, "/later" when the test says, "/echo" with what it was sent.
class TestSite : public WebSite {
 public:
  void Answer(const WebRequest& request, Reply reply) override {
    last_ = request;
    if (request.target == "/later") {
      later_.push_back(std::move(reply));
    } else if (request.target == "/echo") {
      reply({201, "text/plain", request.method + " " + request.body, {{"Location", "/there"}}});
    } else if (request.target == "/") {
      reply({200, "text/html; charset=utf-8", "<p>page"});
    } else {
      reply({404, "text/plain", "nothing"});
    }
  }
  std::unique_ptr<WebPeer> Open(const WebRequest& request) override {
    return request.target == "/socket" ? std::make_unique<TestPeer>(&to_send_) : nullptr;
  }

  WebRequest last_;
  std::vector<Reply> later_;
  int to_send_ = 0;
};

class WebServerTest : public testing::Test {
 protected:
  explicit WebServerTest(const WebOptions& options = {"127.0.0.1", 0, {}})
      : server_(options, site_) {}

  void Serve() { ServeSome(&server_); }
  std::string Ask(const std::string& request) { return web::Ask(&server_, request); }

  TestSite site_;
  WebServer server_;
};

TEST_F(WebServerTest, GivesTheSitesAnswerAndLetsItLoadNothing) {
  const std::string answer = Ask("GET / HTTP/1.1\r\nHost: localhost:1\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200 OK"));
  EXPECT_THAT(answer, HasSubstr("<p>page"));
  EXPECT_THAT(answer, HasSubstr("Content-Security-Policy: default-src 'none'"));
  EXPECT_THAT(answer, Not(HasSubstr("Vary")));
}

TEST_F(WebServerTest, SaysWhetherTheAddressOrThePortIsWrong) {
  const auto why_not = [this](const WebOptions& options) -> std::string {
    try {
      WebServer second(options, site_);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  };
  EXPECT_THAT(why_not({"127.0.0.1", server_.port(), {}}), HasSubstr("give another port"));
  EXPECT_THAT(why_not({"192.0.2.1", 0, {}}), HasSubstr("give an address of this machine"));
}

TEST_F(WebServerTest, AHeadIsAGetWithoutItsBody) {
  const std::string answer = Ask("HEAD / HTTP/1.1\r\nHost: localhost:1\r\n\r\n");
  EXPECT_EQ(site_.last_.method, "GET");
  EXPECT_THAT(answer, HasSubstr("Content-Length: 7"));
  EXPECT_THAT(answer, Not(HasSubstr("<p>page")));
}

TEST_F(WebServerTest, TheSiteHearsMethodBodyAndCondition) {
  const std::string answer =
      Ask("PUT /echo HTTP/1.1\r\nHost: localhost:1\r\nIf-Match: \"3\"\r\nContent-Length: 4\r\n\r\n"
          "body");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 201"));
  EXPECT_THAT(answer, HasSubstr("Location: /there"));
  EXPECT_THAT(answer, HasSubstr("PUT body"));
  EXPECT_EQ(site_.last_.if_match, "\"3\"");
}

TEST_F(WebServerTest, TheSiteHearsWhoAsksAndWhetherTheyTakeGzip) {
  Ask("GET / HTTP/1.1\r\nHost: localhost:1\r\n\r\n");
  EXPECT_EQ(site_.last_.address, "127.0.0.1");
  EXPECT_FALSE(site_.last_.takes_gzip);
  Ask("GET / HTTP/1.1\r\nHost: localhost:1\r\nAccept-Encoding: br, gzip\r\n\r\n");
  EXPECT_TRUE(site_.last_.takes_gzip);
}

TEST_F(WebServerTest, ALargeBodyIsRefusedWithTheReason) {
  const std::string body(WebServer::kMaxBody + 1, 'x');
  const std::string answer = Ask("POST /echo HTTP/1.1\r\nHost: localhost:1\r\nContent-Length: " +
                                 std::to_string(body.size()) + "\r\n\r\n" + body);
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 413"));
  EXPECT_THAT(answer, HasSubstr("16384 bytes"));
  EXPECT_THAT(Ask("POST /echo HTTP/1.1\r\nHost: localhost:1\r\nContent-Length: 16384\r\n\r\n" +
                  body.substr(1)),
              StartsWith("HTTP/1.1 201"));
}

TEST_F(WebServerTest, AnAnswerMayComeLater) {
  WebClient client(server_.port());
  client.Send("GET /later HTTP/1.1\r\nHost: localhost\r\n\r\n");
  Serve();
  EXPECT_EQ(client.Received(), "");
  ASSERT_EQ(site_.later_.size(), 1U);
  site_.later_[0]({200, "text/plain", "here it is"});
  site_.later_[0]({200, "text/plain", "twice"});
  Serve();
  const std::string answer = client.Received();
  EXPECT_THAT(answer, HasSubstr("here it is"));
  EXPECT_THAT(answer, Not(HasSubstr("twice")));
  // The connection goes on; a reply to what was answered already is none to the next question.
  client.Send("GET /later HTTP/1.1\r\nHost: localhost\r\n\r\n");
  Serve();
  site_.later_[0]({200, "text/plain", "old"});
  Serve();
  EXPECT_EQ(client.Received(), "");
}

TEST_F(WebServerTest, AReplyToSomebodyWhoIsGoneIsHarmless) {
  {
    WebClient client(server_.port());
    client.Send("GET /later HTTP/1.1\r\nHost: localhost\r\n\r\n");
    Serve();
  }
  ASSERT_EQ(site_.later_.size(), 1U);
  site_.later_[0]({200, "text/plain", "nobody"});
  Serve();
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"), HasSubstr("<p>page"));
}

TEST(WebServer, AReplyAfterItsEndIsHarmless) {
  TestSite site;
  {
    WebServer server({"127.0.0.1", 0, {}}, site);
    WebClient client(server.port());
    client.Send("GET /later HTTP/1.1\r\nHost: localhost\r\n\r\n");
    server.Serve(20);
  }
  ASSERT_EQ(site.later_.size(), 1U);
  site.later_[0]({200, "text/plain", "nobody"});
}

TEST_F(WebServerTest, ASiteThatDoesNotAnswerIsNotWaitedForForever) {
  WebClient client(server_.port());
  client.Send("GET /later HTTP/1.1\r\nHost: localhost\r\n\r\n");
  server_.Serve(9'000);
  EXPECT_EQ(client.Received(), "");
  server_.Serve(1'500);
  EXPECT_THAT(client.Received(), StartsWith("HTTP/1.1 503"));
}

TEST_F(WebServerTest, RefusesNamesThatAreNotItsOwn) {
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n"), StartsWith("HTTP/1.1 403"));
}

TEST_F(WebServerTest, OnlyItsOwnPageMayConnect) {
  for (const char* origin : {"http://evil.example", "null", ""}) {
    EXPECT_THAT(Ask(UpgradeRequest("/socket", origin)), StartsWith("HTTP/1.1 403")) << origin;
  }
  EXPECT_THAT(Ask(UpgradeRequest("/socket", "http://127.0.0.1:1")), StartsWith("HTTP/1.1 101"));
  EXPECT_THAT(Ask(UpgradeRequest("/", "http://127.0.0.1:1")), StartsWith("HTTP/1.1 404"));
}

TEST_F(WebServerTest, APeerIsSentWhatThereIsAndWhatItShouldNotSayEndsIt) {
  WebClient client(server_.port());
  client.Send(UpgradeRequest("/socket", "http://127.0.0.1:1"));
  site_.to_send_ = 3;
  Serve();
  const std::string received = client.Received();
  for (const char* message : {"\x81\x09message 3", "message 2", "message 1"}) {
    EXPECT_THAT(received, HasSubstr(message));
  }
  client.Send(MaskedFrame("good"));
  Serve();
  EXPECT_EQ(client.Received(), "");
  client.Send(MaskedFrame("bad"));
  Serve();
  EXPECT_THAT(client.Received(), HasSubstr("\x88"));  // the closing handshake
}

TEST_F(WebServerTest, PeersAreCounted) {
  std::vector<std::unique_ptr<WebClient>> clients;
  for (int i = 0; i <= WebOptions().max_peers; ++i) {
    clients.push_back(std::make_unique<WebClient>(server_.port()));
    clients.back()->Send(UpgradeRequest("/socket", "http://127.0.0.1:1"));
    Serve();
    EXPECT_THAT(clients.back()->Received(),
                StartsWith(i < WebOptions().max_peers ? "HTTP/1.1 101" : "HTTP/1.1 503"));
  }
  clients.clear();
  Serve();
  EXPECT_THAT(Ask(UpgradeRequest("/socket", "http://127.0.0.1:1")), StartsWith("HTTP/1.1 101"));
}

// Nobody locks the server by opening connections and saying nothing, or half a request, or by
// leaving the answer where it is, or by asking for what takes long.
TEST_F(WebServerTest, ANewConnectionTakesTheOldestsPlace) {
  const char* const said[] = {"", "GET / HT", "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
                              "GET /later HTTP/1.1\r\nHost: localhost\r\n\r\n"};
  std::vector<std::unique_ptr<WebClient>> clients;
  for (int i = 0; i < 2 * WebServer::kMaxConnections; ++i) {
    clients.push_back(std::make_unique<WebClient>(server_.port()));
    clients.back()->Send(said[i % 4]);
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
  for (const WebSite::Reply& reply : site_.later_) {
    reply({200, "text/plain", "late"});
  }
  Serve();
}

// A connection that cannot be accepted stays in the kernel's queue.
TEST_F(WebServerTest, WithoutAFreeFileItNeitherSpinsNorForgetsWhoWaits) {
  WebClient client(server_.port());
  client.Send("GET / HTTP/1.1\r\nHost: localhost\r\n\r\n");
  rlimit files{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &files), 0);
  const int free_fd = dup(0);
  close(free_fd);
  rlimit none = files;
  none.rlim_cur = static_cast<rlim_t>(free_fd);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const std::clock_t cpu_before = std::clock();
  const auto before = std::chrono::steady_clock::now();
  server_.Serve(300);
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - before;
  const double cpu_s = static_cast<double>(std::clock() - cpu_before) / CLOCKS_PER_SEC;
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &files), 0);
  EXPECT_LT(cpu_s, 0.5 * wall.count());
  bool closed = false;
  EXPECT_EQ(client.Received(&closed), "");
  server_.Serve(300);
  EXPECT_THAT(client.Received(&closed), HasSubstr("<p>page"));
}

TEST_F(WebServerTest, AMalformedRequestGetsAnAnswerAndEndsTheConnection) {
  const std::string host = "Host: localhost\r\n", long_text(100'000, 'x');
  const std::string post = "POST /echo HTTP/1.1\r\n" + host;
  const std::pair<std::string, std::string> cases[] = {
      {"nonsense\r\n\r\n", "400"},
      {post + "Content-Length: -1\r\n\r\n", "400"},
      {post + "Content-Length: 1\r\nContent-Length: 2\r\n\r\nab", "400"},
      {post + "Content-Length: 99999999999999999999\r\n\r\n", "400"},
      {post + "Transfer-Encoding: chunked\r\n\r\nx\r\n", "400"},
      {"GET /" + long_text + " HTTP/1.1\r\n" + host + "\r\n", "414"},
      {"GET / HTTP/1.1\r\n" + host + "X: " + long_text + "\r\n\r\n", "431"}};
  for (const auto& [request, status] : cases) {
    WebClient client(server_.port());
    client.Send(request);
    Serve();
    bool closed = false;
    EXPECT_THAT(client.Received(&closed), StartsWith("HTTP/1.1 " + status))
        << request.substr(0, 80);
    EXPECT_TRUE(closed) << request.substr(0, 80);
  }
}

TEST(WebServer, SaysWhatIsWrongWithItsAddress) {
  TestSite site;
  WebServer first({"127.0.0.1", 0, {}}, site);
  EXPECT_THROW(WebServer({"127.0.0.1", first.port(), {}}, site), std::runtime_error);
  EXPECT_THROW(WebServer({"nowhere", 0, {}}, site), std::runtime_error);
  EXPECT_THROW(WebServer({"127.0.0.1", 0, {}, true, {"https://app.example/"}}, site),
               std::runtime_error);
}

class ForProgramsTest : public WebServerTest {
 protected:
  ForProgramsTest() : WebServerTest({"127.0.0.1", 0, {}, true, {"https://app.example"}}) {}

  std::string Request(const std::string& method, const std::string& origin) {
    site_.last_ = {};
    return Ask(method + " /echo HTTP/1.1\r\nHost: 127.0.0.1:1\r\n" +
               (origin.empty() ? "" : "Origin: " + origin + "\r\n") +
               "Access-Control-Request-Method: PUT\r\nContent-Length: 0\r\n\r\n");
  }
};

TEST_F(ForProgramsTest, WhatTheServerRefusesIsJsonToo) {
  const char* const json = "Content-Type: application/json\r\n";
  EXPECT_THAT(Ask("nonsense\r\n\r\n"),
              AllOf(HasSubstr(json), HasSubstr("{\"error\":\"This is no HTTP: ")));
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n"),
              AllOf(HasSubstr(json), HasSubstr("{\"error\":\"This host name is not known")));
}

TEST_F(ForProgramsTest, ProgramsMayAskWithoutAnOrigin) {
  EXPECT_THAT(Request("POST", ""), StartsWith("HTTP/1.1 201"));
  EXPECT_THAT(Ask(UpgradeRequest("/socket", "")), StartsWith("HTTP/1.1 101"));
}

TEST_F(ForProgramsTest, PagesOfOtherOriginsGetNothing) {
  for (const char* origin : {"http://evil.example", "null", "https://app.example.evil"}) {
    for (const char* method : {"GET", "POST", "DELETE", "OPTIONS"}) {
      const std::string answer = Request(method, origin);
      EXPECT_THAT(answer, StartsWith("HTTP/1.1 403")) << method << " " << origin;
      EXPECT_THAT(answer, Not(HasSubstr("Access-Control"))) << method << " " << origin;
      EXPECT_EQ(site_.last_.method, "") << "the site was asked";
    }
    EXPECT_THAT(Ask(UpgradeRequest("/socket", origin)), StartsWith("HTTP/1.1 403")) << origin;
  }
}

// An image or a script of another's page comes without an origin.
TEST_F(ForProgramsTest, PagesOfOthersEmbedNothing) {
  const auto get = [this](const std::string& from) {
    return Ask("GET /echo HTTP/1.1\r\nHost: 127.0.0.1:1\r\nSec-Fetch-Site: " + from + "\r\n\r\n");
  };
  EXPECT_THAT(get("cross-site"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(get("same-site"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(get("none"), StartsWith("HTTP/1.1 201")) << "typed by the user";
  EXPECT_THAT(get("cross-site\r\nSec-Fetch-Dest: iframe"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(get("cross-site\r\nSec-Fetch-Dest: document"), StartsWith("HTTP/1.1 201"))
      << "a link in another's page, which the user leaves";
}

TEST_F(ForProgramsTest, PagesOfAnAllowedOriginMay) {
  const std::string answer = Request("POST", "https://app.example");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 201"));
  EXPECT_THAT(answer, HasSubstr("Access-Control-Allow-Origin: https://app.example\r\n"));
  EXPECT_THAT(answer, HasSubstr("Vary: Origin"));
  const std::string preflight = Request("OPTIONS", "https://app.example");
  EXPECT_THAT(preflight, StartsWith("HTTP/1.1 204"));
  EXPECT_THAT(preflight, HasSubstr("Access-Control-Allow-Methods: GET, POST, PUT, DELETE"));
  EXPECT_THAT(preflight, HasSubstr("Access-Control-Allow-Headers: Content-Type, If-Match"));
  EXPECT_EQ(site_.last_.method, "") << "a preflight is the server's own";
  EXPECT_THAT(Ask(UpgradeRequest("/socket", "https://app.example")), StartsWith("HTTP/1.1 101"));
}

}  // namespace
}  // namespace pangea::web

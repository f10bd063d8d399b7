// The viewer's page and its conversation, through a web server.

#include "viewer/web/page_site.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "viewer/viewer_test_world.h"
#include "viewer/web/page_link.h"
#include "web/testing/web_client.h"
#include "web/web_server.h"

namespace pangea::viewer {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using web::MaskedFrame;
using web::UpgradeRequest;
using web::WebClient;

class PageSiteTest : public testing::Test {
 protected:
  void Serve() { web::ServeSome(&server_); }
  std::string Ask(const std::string& request) { return web::Ask(&server_, request); }

  TestShow show_;
  PageSite site_{
      {{"/",
        {"text/html; charset=utf-8", std::make_shared<const std::string>("<p>page"), nullptr}}},
      show_};
  web::WebServer server_{{"127.0.0.1", 0, {}}, site_};
};

TEST_F(PageSiteTest, GivesOutThePageWithItsPolicy) {
  const std::string answer = Ask("GET / HTTP/1.1\r\nHost: localhost:1\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200 OK"));
  EXPECT_THAT(answer, HasSubstr("<p>page"));
  EXPECT_THAT(answer, HasSubstr("Content-Security-Policy: default-src 'self'; connect-src 'self' "
                                "ws://localhost:1 wss://localhost:1;"));
}

TEST_F(PageSiteTest, RefusesWhatIsNotThere) {
  for (const char* target : {"/etc/passwd", "/../../etc/passwd", "/%2e%2e/x", "//", "*"}) {
    EXPECT_THAT(Ask(std::string("GET ") + target + " HTTP/1.1\r\nHost: localhost\r\n\r\n"),
                StartsWith("HTTP/1.1 404"))
        << target;
  }
  EXPECT_THAT(Ask("DELETE / HTTP/1.1\r\nHost: localhost\r\n\r\n"), StartsWith("HTTP/1.1 405"));
}

// The policy header names the host the request was for: what it says there is read first.
TEST_F(PageSiteTest, NothingOfAHeaderGetsIntoThePolicy) {
  const std::string answer =
      Ask("GET / HTTP/1.1\r\nHost: localhost:80; script-src https://evil.example\r\n\r\n");
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(answer, testing::Not(HasSubstr("evil")));
}

TEST_F(PageSiteTest, OnlyItsOwnPageMayConnect) {
  for (const char* origin : {"http://evil.example", "null", ""}) {
    EXPECT_THAT(Ask(UpgradeRequest("/", origin)), StartsWith("HTTP/1.1 403")) << origin;
  }
  const std::string answer = Ask(UpgradeRequest("/", "http://127.0.0.1:1"));
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 101"));
  EXPECT_THAT(answer, HasSubstr("\"source\":\"test\""));
}

TEST_F(PageSiteTest, WhatNoPageSaysEndsTheConversation) {
  for (const std::string& text :
       {std::string("nonsense"), std::string(PageLink::kMaxText + 1, ' ')}) {
    WebClient client(server_.port());
    client.Send(UpgradeRequest("/", "http://127.0.0.1:1"));
    Serve();
    EXPECT_THAT(client.Received(), StartsWith("HTTP/1.1 101"));
    client.Send(MaskedFrame(R"({"play": false})"));
    Serve();
    EXPECT_FALSE(show_.clock().playing);
    bool closed = false;
    client.Send(MaskedFrame(text));
    Serve();
    // The closing handshake: its frame begins with 0x88.
    EXPECT_THAT(client.Received(&closed), HasSubstr("\x88"));
    show_.Play(true);
  }
}

}  // namespace
}  // namespace pangea::viewer

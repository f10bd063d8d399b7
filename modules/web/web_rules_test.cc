#include "web/web_rules.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace pangea::web {
namespace {

TEST(WebRules, HostsThatAreThisMachine) {
  const std::vector<std::string> names = {"robot.local", "DESKTOP-7.local"};
  for (const char* host :
       {"localhost", "LocalHost:1", "desktop-7.local:8443", "Robot.local", "localhost:8080",
        "127.0.0.1:8080", "192.168.1.7", "[::1]", "[::1]:8080", "robot.local:8080"}) {
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

TEST(WebRules, AnIpv6AddressIsInBracketsInAUrl) {
  EXPECT_EQ(HostInUrl("::1"), "[::1]");
  for (const char* host : {"127.0.0.1", "robot.local"}) {
    EXPECT_EQ(HostInUrl(host), host);
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

TEST(WebRules, WhatABrowserGivesAsAnOrigin) {
  for (const char* origin : {"https://app.example", "http://10.0.0.7:5173", "http://[::1]:80"}) {
    EXPECT_TRUE(IsOrigin(origin)) << origin;
  }
  for (const char* origin : {"", "*", "null", "https://", "app.example", "https://app.example/",
                             "ftp://app.example", "https://app.example/a", "http://a\r\nb"}) {
    EXPECT_FALSE(IsOrigin(origin)) << origin;
  }
}

}  // namespace
}  // namespace pangea::web

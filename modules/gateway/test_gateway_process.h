#pragma once

// For tests of the gateway's process: one with real TLS connections, on buses in this process.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bus/process.h"
#include "gateway/gateway_process.h"
#include "gateway/test_client.h"
#include "messages/encoding.h"
#include "pangea/status_t.hpp"

namespace pangea {

class GatewayProcessTest : public testing::Test {
 protected:
  static constexpr int64_t kSecond = 1'000'000;
  static constexpr int64_t kDay = 86'400 * kSecond;
  inline static const MachineNames kNames{{"localhost"}, {"127.0.0.1"}};

  GatewayProcessTest() {
    std::filesystem::remove_all(folder_);
    site_ = site::OpenSite(folder_);
    MakeGatewayFolders(site_);
    identity_ = OpenIdentity(site_, kNames, Date());
    Open(identity_);
    server_bus_.Subscribe("STATUS_gateway", [this](const std::string&, Bytes data) {
      EXPECT_TRUE(DecodeMessage(data, &status_));
    });
    link_bus_.Subscribe("LINK_UP_[0-9]+", [this](const std::string& channel, Bytes data) {
      up_.emplace_back(channel, std::string(data.begin(), data.end()));
    });
  }

  void Open(const GatewayIdentity& identity) {
    const auto page = std::make_shared<const std::string>("<p>page");
    const GatewayProcess::Options options{
        {"127.0.0.1", 0, {}}, {{"/", {"text/html", page, nullptr}}}, identity, "127.0.0.1"};
    process_.emplace(link_bus_, server_bus_, site_, options);
  }
  void Serve(int rounds = 5) {
    for (int i = 0; i < rounds; ++i) {
      process_->Tick(WallUtime() + skipped_us_, Date());
      process_->Serve(10);
      link_bus_.Drain();
      server_bus_.Drain();
    }
  }
  int64_t Date() const { return (WallUtime() + skipped_us_) / kSecond; }
  // As if so much time had passed, except for sockets.
  void Skip(int64_t us) {
    skipped_us_ += us;
    Serve();
  }
  std::string Ask(const std::string& request) {
    web::TlsClient client(process_->port(), identity_.authority_pem);
    client.Send(request);
    std::string answer;
    for (int i = 0; i < 5; ++i) {
      Serve(2);
      answer += client.Received();
    }
    return answer;
  }
  std::string Post(const std::string& body, const std::string& headers = "") {
    return Ask(
        fmt::format("POST /v1/join HTTP/1.1\r\nHost: 127.0.0.1\r\n{}Content-Length: {}\r\n\r\n{}",
                    headers, body.size(), body));
  }
  static nlohmann::json BodyOf(const std::string& answer) {
    return nlohmann::json::parse(answer.substr(answer.find("\r\n\r\n") + 4), nullptr, false);
  }
  static std::string JoinBody(const std::string& code) {
    return nlohmann::json({{"code", code}, {"name", "Anna"}}).dump();
  }
  std::string NewCode() {
    return Admission(site_).Make({"", AnchorRight::kEditOwn, WallUtime() / kSecond + 3600});
  }
  SecretKey KeyOf(int32_t agent_id) {
    return ReadKeyFileOf(site_.keys() / KeyFileName(agent_id), agent_id);
  }
  SecretKey NewKey(int32_t agent_id) {
    MakeKeyFile(site_.keys() / KeyFileName(agent_id), agent_id);
    Skip(kSecond);
    return KeyOf(agent_id);
  }
  // The newest status's counter of refusals whose reason begins so.
  int64_t NumRefused(const std::string& reason) {
    Skip(kSecond);
    for (const counter_t& refused : status_.refused) {
      if (refused.name.starts_with(reason)) {
        return refused.count;
      }
    }
    return 0;
  }

  const std::filesystem::path folder_ = testing::TempDir() + "/gateway_process";
  site::Site site_;
  GatewayIdentity identity_;
  LocalBus link_bus_, server_bus_;
  std::optional<GatewayProcess> process_;
  status_t status_{};
  std::vector<std::pair<std::string, std::string>> up_;
  int64_t skipped_us_ = 0;
};

}  // namespace pangea

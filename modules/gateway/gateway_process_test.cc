// The gateway with real TLS connections, on buses in this process.

#include "gateway/gateway_process.h"

#include <fmt/chrono.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "agent_handler/agent_handler_process.h"
#include "bus/process.h"
#include "files/text_file.h"
#include "gateway/test_client.h"
#include "messages/testing/test_keyframes.h"
#include "pangea/have_t.hpp"
#include "pangea/status_t.hpp"
#include "uplink/uplink_process.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;

constexpr int64_t kSecond = 1'000'000;
constexpr int64_t kDay = 86'400 * kSecond;
const MachineNames kNames{{"localhost"}, {"127.0.0.1"}};

class GatewayProcessTest : public testing::Test {
 protected:
  GatewayProcessTest() {
    fs::remove_all(folder_);
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
  static json BodyOf(const std::string& answer) {
    return json::parse(answer.substr(answer.find("\r\n\r\n") + 4), nullptr, false);
  }
  static std::string JoinBody(const std::string& code) {
    return json({{"code", code}, {"name", "Anna"}}).dump();
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

  const fs::path folder_ = testing::TempDir() + "/gateway_process";
  site::Site site_;
  GatewayIdentity identity_;
  LocalBus link_bus_, server_bus_;
  std::optional<GatewayProcess> process_;
  status_t status_{};
  std::vector<std::pair<std::string, std::string>> up_;
  int64_t skipped_us_ = 0;
};

TEST_F(GatewayProcessTest, AVisitorGetsThePageAndAKeyOnce) {
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"), HasSubstr("<p>page"));
  EXPECT_EQ(ToDer(identity_.authority_pem), [this] {
    const std::string answer = Ask("GET /ca.crt HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
    return answer.substr(answer.find("\r\n\r\n") + 4);
  }());
  const std::string code = NewCode();
  const std::string answer = Post(JoinBody(code), "Origin: https://127.0.0.1\r\n");
  ASSERT_THAT(answer, StartsWith("HTTP/1.1 200"));
  const json joined = BodyOf(answer);
  EXPECT_EQ(joined["site"], "gateway_process");
  EXPECT_EQ(joined["key"], ToHex(KeyOf(joined["agent"])));
  EXPECT_THAT(answer, Not(HasSubstr("Set-Cookie")));

  EXPECT_THAT(Post(JoinBody(code)), StartsWith("HTTP/1.1 403"));
  EXPECT_EQ(NumRefused("join: This code"), 1);
}

TEST_F(GatewayProcessTest, NamesThatAreNotUtf8) {
  const std::string code = NewCode();
  EXPECT_THAT(Post(R"({"code": ")" + code + R"(", "name": "Ann)" + "\xc3\"}"),
              StartsWith("HTTP/1.1 400"));
  EXPECT_EQ(NumRefused("join: the request is malformed"), 1);
  ASSERT_THAT(Post(JoinBody(code)), StartsWith("HTTP/1.1 200")) << "the code was not used up";
  // A file that somebody edited costs only the name.
  std::ofstream(site_.gateway() / "agents" / "1001.json")
      << R"({"agent": 1001, "joined_s": 1, "name": "Ann)"
      << "\xc3\"}";
  NewKey(5);
  const json told = BodyOf(Ask("GET /v1/info HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"));
  EXPECT_THAT(told["agents"], SizeIs(2));
  EXPECT_EQ(told["agents"][1]["agent"], 1001);
  EXPECT_EQ(told["agents"][1]["name"], "");
}

// The phone's uplink here is on a bus of its own, which its socket joins with the gateway.
TEST_F(GatewayProcessTest, KeyframesOfABrowserAreJournalled) {
  const json joined = BodyOf(Post(JoinBody(NewCode())));
  const int32_t agent_id = joined["agent"];
  const MapId map{agent_id, 1000};
  const int64_t start = WallUtime();
  AgentHandlerProcess handler(link_bus_, server_bus_, site_.journal().string(),
                              site_.keys().string(), start, AgentHandlerOptions{});
  LocalBus agent_bus, phone_bus;
  UplinkProcess uplink(agent_bus, phone_bus, agent_id, KeyOf(agent_id), UplinkOptions{});
  GatewayAgent socket(process_->port(), agent_id, KeyOf(agent_id), identity_.authority_pem);
  phone_bus.Subscribe("LINK_UP_[0-9]+", [&](const std::string&, Bytes data) {
    if (socket.proven()) {
      socket.Send(data);
    }
  });
  std::vector<std::vector<uint8_t>> journalled;
  server_bus_.Subscribe(fmt::format("KEYFRAME_{}", agent_id), [&](const std::string&, Bytes data) {
    journalled.emplace_back(data.begin(), data.end());
  });
  int32_t acknowledged = -1;
  agent_bus.Subscribe("HAVE", [&](const std::string&, Bytes data) {
    have_t have{};
    ASSERT_TRUE(DecodeMessage(data, &have));
    acknowledged = have.num_maps > 0 ? have.highest_seq[0] : -1;
  });
  constexpr int kKeyframes = 20;
  for (int seq = 0; seq < kKeyframes; ++seq) {
    agent_bus.Publish(fmt::format("KEYFRAME_{}", agent_id), EncodeTestKeyframe({map, seq}));
  }
  for (int i = 0; i < 1000 && acknowledged < kKeyframes - 1; ++i) {
    agent_bus.Drain();
    uplink.Poll(SteadyMicros());
    uplink.Tick(WallUtime());
    phone_bus.Drain();
    Serve(1);
    handler.Poll(SteadyMicros());
    handler.Tick(WallUtime());
    link_bus_.Drain();
    server_bus_.Drain();
    for (const std::string& packet : socket.Received()) {
      phone_bus.Publish(fmt::format("LINK_DOWN_{}", agent_id),
                        {reinterpret_cast<const uint8_t*>(packet.data()), packet.size()});
    }
    phone_bus.Drain();
  }
  EXPECT_EQ(acknowledged, kKeyframes - 1);
  ASSERT_THAT(journalled, SizeIs(kKeyframes));
  for (int seq = 0; seq < kKeyframes; ++seq) {
    EXPECT_EQ(journalled[static_cast<size_t>(seq)], EncodeTestKeyframe({map, seq}));
  }
}

TEST_F(GatewayProcessTest, ARevokedAgentIsCutOffWithinASecond) {
  const SecretKey key = NewKey(5);
  GatewayAgent anna(process_->port(), 5, key);
  for (int i = 0; i < 10 && !anna.proven(); ++i) {
    Serve(2);
    anna.Received();
  }
  Serve();
  anna.Send(std::vector<uint8_t>{1, 2, 3});
  Serve();
  EXPECT_THAT(up_, ElementsAre(testing::Pair("LINK_UP_5", "\1\2\3")));
  Admission(site_).Revoke(5);
  Skip(kSecond);
  anna.Received();
  EXPECT_EQ(anna.close_code(), 4401);
}

TEST_F(GatewayProcessTest, ARecordingIsKeptUnderTheSite) {
  GatewayAgent anna(process_->port(), 5, NewKey(5), identity_.authority_pem, "/recording");
  for (int i = 0; i < 10 && !anna.proven(); ++i) {
    Serve(2);
    anna.Received();
  }
  const std::string zip = "PK\x03\x04" + std::string(99'996, 'z');
  anna.Send(std::vector<uint8_t>{0xa0, 0x86, 1, 0, 0, 0, 0, 0});  // 100,000
  for (size_t sent = 0; sent < zip.size(); sent += 50'000) {
    const std::string part = zip.substr(sent, 50'000);
    anna.Send(std::vector<uint8_t>(part.begin(), part.end()));
  }
  for (int i = 0; i < 20 && anna.close_code() == 0; ++i) {
    Serve(2);
    anna.Received();
  }
  EXPECT_EQ(anna.close_code(), RecordingSocket::kKept);
  EXPECT_THAT(anna.close_reason(), HasSubstr("_agent_5.zip"));
  EXPECT_EQ(ReadTextFile(site_.recordings() / anna.close_reason()), zip);
  EXPECT_EQ(fs::status(site_.recordings()).permissions(), fs::perms::owner_all);
}

// The certificate that a new connection gets.
class CertificateTest : public GatewayProcessTest {
 protected:
  std::string Certificate() {
    web::TlsClient client(process_->port());
    for (int i = 0; i < 10 && client.certificate().empty(); ++i) {
      Serve(1);
    }
    return client.certificate();
  }
  // Writes a certificate that a user brings, valid for so many days more; returns its file.
  std::string WriteOwn(int days) {
    const int64_t made_s = Date() - (kServerDays - days) * (kDay / kSecond);
    const Identity own =
        MakeServerCertificate(MakeAuthority("own", {}, made_s), kNames, made_s).identity;
    WriteFile("own.pem", own.certificate_chain_pem);
    WriteFile("own.key", own.private_key_pem);
    return (folder_ / "own.pem").string();
  }
  void WriteFile(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name) << text;
  }
};

TEST_F(CertificateTest, IsRenewedWhileTheGatewayRuns) {
  GatewayAgent anna(process_->port(), 5, NewKey(5));
  for (int i = 0; i < 10 && !anna.proven(); ++i) {
    Serve(2);
    anna.Received();
  }
  Serve();
  const std::string first = Certificate();
  Skip((kServerDays - 31) * kDay);
  EXPECT_EQ(Certificate(), first);
  Skip(2 * kDay);
  const std::string second = Certificate();
  EXPECT_NE(second, first);
  EXPECT_TRUE(IsGoodFor({second, ReadTextFile(site_.gateway() / "server.key")},
                        {identity_.authority_pem, ""}, kNames, Date(), kServerDays - 2));
  EXPECT_EQ(ReadTextFile(site_.gateway() / "server.pem").substr(0, second.size()), second);
  Skip(kServerDays * kDay);
  EXPECT_NE(Certificate(), second);
  anna.Send(std::vector<uint8_t>{1, 2, 3});
  Serve();
  EXPECT_THAT(up_, ElementsAre(testing::Pair("LINK_UP_5", "\1\2\3"))) << "the link was cut";
}

TEST_F(CertificateTest, StaysWhileItCannotBeRenewed) {
  const std::string first = Certificate();
  fs::remove(site_.gateway() / "ca.key");
  Skip((kServerDays - 29) * kDay);
  EXPECT_EQ(Certificate(), first);
  EXPECT_GE(NumRefused((site_.gateway() / "ca.key").string()), 1);
}

TEST_F(CertificateTest, OfTheUserIsOnlyWarnedAbout) {
  const std::string file = WriteOwn(31);
  Open(ReadIdentity(file, (folder_ / "own.key").string()));
  const std::string first = Certificate();
  EXPECT_THAT(status_.refused, IsEmpty());
  Skip(2 * kDay);
  const std::string date = fmt::format("{:%Y-%m-%d}", fmt::gmtime(ExpiryOf(first)));
  EXPECT_EQ(NumRefused(fmt::format("{}: this certificate expires on {}", file, date)), 1);
  Skip(30 * kDay);
  EXPECT_EQ(NumRefused(fmt::format("{}: this certificate has expired on {}", file, date)), 1);
  EXPECT_EQ(Certificate(), first);
}

// While strangers do what they like, an agent's packets go on.
class HostileTest : public GatewayProcessTest {
 protected:
  HostileTest() : anna_(process_->port(), 5, NewKey(5)) {
    for (int i = 0; i < 10 && !anna_.proven(); ++i) {
      Serve(2);
      anna_.Received();
    }
    Serve();
  }
  void ExpectLinkWorks() {
    up_.clear();
    anna_.Send(std::vector<uint8_t>{1, 2, 3});
    link_bus_.Publish("LINK_DOWN_5", std::vector<uint8_t>{'d', 'o', 'w', 'n'});
    Serve();
    EXPECT_THAT(up_, SizeIs(1));
    EXPECT_THAT(anna_.Received(), ElementsAre("down"));
  }

  // Opens a WebSocket without proof of a key.
  std::unique_ptr<web::TlsClient> OpenSocket() {
    auto client = std::make_unique<web::TlsClient>(process_->port());
    client->Send(web::UpgradeRequest("/link?agent=5", ""));
    std::string received;
    for (int i = 0; i < 10 && received.empty(); ++i) {
      Serve(1);
      received = client->Received();
    }
    EXPECT_THAT(received, StartsWith("HTTP/1.1 101"));
    return client;
  }

  GatewayAgent anna_;
};

TEST_F(HostileTest, GarbageInPlaceOfAHandshake) {
  web::WebClient client(process_->port());
  client.Send(std::string(10'000, '\x55'));
  Serve();
  bool closed = false;
  client.Received(&closed);
  EXPECT_TRUE(closed);
  EXPECT_EQ(NumRefused("TLS handshake: "), 1);
  ExpectLinkWorks();
}

TEST_F(HostileTest, HalfAHandshake) {
  web::WebClient client(process_->port());
  client.Send(std::string("\x16\x03\x01\x02\x00\x01\x00", 7));  // the begin of a hello
  process_->Serve(6'000);
  bool closed = false;
  client.Received(&closed);
  EXPECT_TRUE(closed);
  EXPECT_EQ(NumRefused("TLS handshake: "), 1);
  ExpectLinkWorks();
}

TEST_F(HostileTest, AMillionBytesOfHeader) {
  web::TlsClient client(process_->port());
  client.Send("GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + std::string(1'000'000, 'x'));
  for (int i = 0; i < 20 && !client.closed(); ++i) {
    Serve(1);
  }
  EXPECT_TRUE(client.closed());
  EXPECT_EQ(NumRefused("request: The headers are too long"), 1);
  ExpectLinkWorks();
}

TEST_F(HostileTest, PagesOfOtherOrigins) {
  const std::string code = NewCode();
  EXPECT_THAT(Post(JoinBody(code), "Origin: https://evil.example\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(Ask(web::UpgradeRequest("/link?agent=5", "https://evil.example")),
              StartsWith("HTTP/1.1 403"));
  EXPECT_EQ(NumRefused("request: Pages of other origins"), 2);
  EXPECT_THAT(Ask("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_EQ(NumRefused("request: This host name is not known"), 1);
  EXPECT_THAT(Post(JoinBody(code)), StartsWith("HTTP/1.1 200")) << "the code was not used up";
  ExpectLinkWorks();
}

TEST_F(HostileTest, GarbageOnASocket) {
  const auto client = OpenSocket();
  client->Send(web::MaskedFrame("no proof", web::Frame::kBinary));
  Serve();
  EXPECT_THAT(client->Received(), HasSubstr("the key is wrong"));
  EXPECT_EQ(NumRefused("socket: the key is wrong"), 1);
  {
    const auto talker = OpenSocket();
    talker->Send(web::MaskedFrame(std::string(50'000, 'x'), web::Frame::kBinary));
    Serve();
    EXPECT_THAT(talker->Received(), HasSubstr("\x03\xf1")) << "1009: too large";
  }
  ExpectLinkWorks();
}

TEST_F(HostileTest, SocketsThatSayNothing) {
  std::vector<std::unique_ptr<web::TlsClient>> strangers;
  for (int i = 0; i < 20; ++i) {
    strangers.push_back(OpenSocket());
  }
  ExpectLinkWorks();
  process_->Serve(5'000);
  Serve();
  EXPECT_EQ(NumRefused("socket: no proof of a key within 5 s"), 20);
  ExpectLinkWorks();
}

TEST_F(HostileTest, GuessingCodes) {
  for (int i = 0; i < AttemptLimit::kBurst; ++i) {
    EXPECT_THAT(Post(JoinBody("ABCD-EFGH-JKMN-PQRS")), StartsWith("HTTP/1.1 403"));
  }
  EXPECT_THAT(Post(JoinBody("ABCD-EFGH-JKMN-PQRS")), StartsWith("HTTP/1.1 429"));
  EXPECT_EQ(NumRefused("join: too many wrong codes"), 1);
  ExpectLinkWorks();
}

}  // namespace
}  // namespace pangea

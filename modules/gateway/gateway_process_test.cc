// The gateway with visitors, agents, and strangers.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "agent_handler/agent_handler_process.h"
#include "files/text_file.h"
#include "gateway/test_gateway_process.h"
#include "messages/encoding.h"
#include "messages/testing/test_keyframes.h"
#include "pangea/have_t.hpp"
#include "uplink/uplink_process.h"

namespace pangea {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;
using testing::StartsWith;

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

// The gateway without sockets, buses and files.

#include "gateway/gateway.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "link/agent_key.h"
#include "link/link_session.h"

namespace pangea {
namespace {

using nlohmann::json;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::SizeIs;
using web::WebAnswer;

class NoStore : public RecordingStore {
 public:
  std::string Begin(int32_t agent_id, int64_t) override {
    begun.insert(agent_id);
    return "";
  }
  std::string Write(int32_t, Bytes) override { return ""; }
  Kept Finish(int32_t) override { return {"a.zip", ""}; }
  void Abort(int32_t agent_id) override { begun.erase(agent_id); }
  std::set<int32_t> begun;
};

class GatewayTest : public testing::Test {
 protected:
  GatewayTest()
      : gateway_(
            {"hall", "pangea 0.1", PageOf("<p>page"), "authority"},
            {[this](const JoinRequest& request) {
               joins_.push_back(request);
               return next_join_;
             },
             [this](int32_t agent_id, Bytes packet) {
               up_.emplace_back(agent_id, std::string(packet.begin(), packet.end()));
             },
             [this](const std::string& why) { refused_.push_back(why); }, [this] { ++dropped_; }},
            store_) {
    gateway_.SetNow(now_us_);
    gateway_.SetAgents(Agents({7, 8}));
  }

  static web::Page PageOf(const std::string& text) {
    return {
        {"/", {"text/html; charset=utf-8", std::make_shared<const std::string>(text), nullptr}}};
  }
  static SecretKey KeyOf(int32_t agent_id) {
    return SecretKey(std::array<uint8_t, SecretKey::kBytes>{static_cast<uint8_t>(agent_id)});
  }
  static std::map<int32_t, Gateway::Agent> Agents(const std::vector<int32_t>& ids) {
    std::map<int32_t, Gateway::Agent> agents;
    for (const int32_t id : ids) {
      agents.insert({id, {KeyOf(id), id == 7 ? "Anna" : ""}});
    }
    return agents;
  }
  WebAnswer Ask(const std::string& method, const std::string& target, const std::string& body = "",
                const std::string& address = "10.0.0.1") {
    WebAnswer got;
    web::WebRequest request{method, target, "10.0.0.9:8443", "", body};
    request.address = address;
    gateway_.Answer(request, [&](WebAnswer answer) { got = std::move(answer); });
    return got;
  }
  WebAnswer Join(const std::string& address = "10.0.0.1") {
    return Ask("POST", "/v1/join", R"({"code": "ABCD-EFGH-JKMN-PQRS", "name": "Anna"})", address);
  }
  std::unique_ptr<web::WebPeer> Open(const std::string& target) {
    return gateway_.Open({"GET", target, "10.0.0.9:8443", "", ""});
  }
  static std::string ProofFor(const SecretKey& key, int32_t agent_id, web::WebPeer* socket) {
    GatewayNonce nonce{};
    const auto sent = socket->Next().value_or(std::vector<uint8_t>());
    EXPECT_EQ(sent.size(), nonce.size());
    std::copy(sent.begin(), sent.end(), nonce.begin());
    const auto proof = GatewayProof(key, agent_id, nonce);
    return {proof.begin(), proof.end()};
  }
  // One that has proven its key.
  std::unique_ptr<web::WebPeer> Connect(int32_t agent_id, const std::string& path = "/link") {
    auto socket = Open(path + "?agent=" + std::to_string(agent_id));
    EXPECT_TRUE(socket->Receive(ProofFor(KeyOf(agent_id), agent_id, socket.get())));
    return socket;
  }
  static std::string TextOf(const std::optional<std::vector<uint8_t>>& message) {
    return message ? std::string(message->begin(), message->end()) : "";
  }
  static Bytes BytesOf(std::string_view text) {
    return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
  }

  int64_t now_us_ = 1'000'000;
  std::vector<JoinRequest> joins_;
  JoinResult next_join_{200, "", 7, "00ff"};
  std::vector<std::pair<int32_t, std::string>> up_;
  std::vector<std::string> refused_;
  int dropped_ = 0;
  NoStore store_;
  Gateway gateway_;
};

// The bytes that a page computes with WebCrypto, or Python:
// hmac.new(bytes([7]) + bytes(31), b"pangea-gateway-v1:7:" + bytes(range(32)), "sha256")
TEST(GatewayProof, IsHmacSha256OfTheTextAndTheNonce) {
  GatewayNonce nonce{};
  for (size_t i = 0; i < nonce.size(); ++i) {
    nonce[i] = static_cast<uint8_t>(i);
  }
  const auto proof = GatewayProof(SecretKey(std::array<uint8_t, SecretKey::kBytes>{7}), 7, nonce);
  EXPECT_EQ(ToHex(SecretKey(proof)),
            "fde88b3455eafc59723f4bb7bcf64199d49d4099094c8544e6a2d5ffd53aaba8");
}

TEST_F(GatewayTest, GivesOutThePageIsolatedFromOthers) {
  const WebAnswer answer = Ask("GET", "/");
  EXPECT_EQ(*answer.file, "<p>page");
  EXPECT_THAT(answer.headers, Contains(Pair("Cross-Origin-Opener-Policy", "same-origin")));
  EXPECT_THAT(answer.headers, Contains(Pair("Cross-Origin-Embedder-Policy", "require-corp")));
  EXPECT_THAT(answer.headers, Contains(Pair("Content-Security-Policy",
                                            HasSubstr("connect-src 'self' wss://10.0.0.9:8443;"))));
  EXPECT_EQ(Ask("GET", "/nothing").status, 404);
}

TEST_F(GatewayTest, GivesOutItsAuthorityAndWhoIsThere) {
  EXPECT_EQ(Ask("GET", "/ca.crt").body, "authority");
  EXPECT_EQ(Ask("GET", "/ca.crt").type, "application/x-x509-ca-cert");
  const auto anna = Connect(7);
  const json info = json::parse(Ask("GET", "/v1/info").body);
  EXPECT_EQ(info, json::parse(R"({"site": "hall", "version": "pangea 0.1", "agents": [
    {"agent": 7, "name": "Anna", "connected": true}, {"agent": 8, "name": "", "connected": false}]})"));
  EXPECT_EQ(Ask("POST", "/v1/info").status, 405);
}

TEST_F(GatewayTest, JoiningGivesAKeyOrTheReason) {
  WebAnswer answer = Join();
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(json::parse(answer.body),
            json::parse(R"({"agent": 7, "key": "00ff", "site": "hall"})"));
  ASSERT_THAT(joins_, SizeIs(1));
  EXPECT_EQ(joins_[0].code, "ABCDEFGHJKMNPQRS");
  EXPECT_EQ(joins_[0].name, "Anna");
  next_join_ = {403, "too old", 0, ""};
  answer = Join();
  EXPECT_EQ(answer.status, 403);
  EXPECT_EQ(json::parse(answer.body)["error"], "too old");
  EXPECT_EQ(Ask("GET", "/v1/join").status, 405);
  EXPECT_EQ(Ask("POST", "/v1/join", "nonsense").status, 400);
  EXPECT_THAT(joins_, SizeIs(2));
}

TEST_F(GatewayTest, WhoIsWrongTooOftenWaits) {
  next_join_ = {403, "too old", 0, ""};
  for (int i = 0; i < AttemptLimit::kBurst; ++i) {
    EXPECT_EQ(Join().status, 403);
  }
  next_join_ = {200, "", 7, "00ff"};
  EXPECT_EQ(Join().status, 429);
  EXPECT_EQ(Join("10.0.0.2").status, 200);
  gateway_.SetNow(now_us_ + AttemptLimit::kInterval_us);
  EXPECT_EQ(Join().status, 200);
  EXPECT_THAT(refused_, Contains("join: too many wrong codes"));
}

TEST_F(GatewayTest, AServerThatIsFullIsNoWrongCode) {
  next_join_ = {503, "full", 0, ""};
  for (int i = 0; i <= AttemptLimit::kBurst; ++i) {
    EXPECT_EQ(Join().status, 503);
  }
}

TEST_F(GatewayTest, OnlyALinkOfAnAgentIsASocket) {
  for (const char* target : {"/", "/link", "/link?agent=", "/link?agent=0", "/link?agent=65536",
                             "/link?agent=-1", "/link?agent=7x", "/link?agent=7&a=b"}) {
    EXPECT_EQ(Open(target), nullptr) << target;
  }
  EXPECT_NE(Open("/link?agent=9"), nullptr) << "it does not tell who has a key";
}

TEST_F(GatewayTest, PacketsGoBothWaysUnchanged) {
  const auto anna = Connect(7);
  EXPECT_TRUE(anna->Receive(std::string("up\0\xff", 4)));
  EXPECT_THAT(up_, ElementsAre(Pair(7, std::string("up\0\xff", 4))));
  gateway_.SendDown(7, BytesOf("first"));
  gateway_.SendDown(8, BytesOf("another's"));
  gateway_.SendDown(7, BytesOf("second"));
  EXPECT_EQ(TextOf(anna->Next()), "first");
  EXPECT_EQ(TextOf(anna->Next()), "second");
  EXPECT_EQ(anna->Next(), std::nullopt);
  EXPECT_EQ(anna->Ending(), std::nullopt);
}

TEST_F(GatewayTest, OnlyProofOfTheAgentsKeyOpensTheLink) {
  const auto try_proof = [&](int32_t agent_id, const SecretKey& key, int32_t of_agent) {
    const auto socket = Open("/link?agent=" + std::to_string(agent_id));
    EXPECT_FALSE(socket->Receive(ProofFor(key, of_agent, socket.get())));
    EXPECT_EQ(socket->Ending().value().code, 4401);
  };
  try_proof(7, KeyOf(8), 7);
  try_proof(7, KeyOf(7), 8);
  try_proof(9, KeyOf(9), 9);  // has no key here
  const auto socket = Open("/link?agent=7");
  const std::string proof = ProofFor(KeyOf(7), 7, socket.get());
  const auto other = Open("/link?agent=7");
  EXPECT_FALSE(other->Receive(proof)) << "a proof that somebody recorded";
  EXPECT_FALSE(Open("/link?agent=7")->Receive(proof.substr(1)));
  EXPECT_FALSE(Open("/link?agent=7")->Receive(""));
  EXPECT_THAT(up_, IsEmpty());
  EXPECT_EQ(gateway_.num_connected(), 0);
  EXPECT_TRUE(socket->Receive(proof));
}

TEST_F(GatewayTest, WhoSaysNothingIsToldToGo) {
  const auto silent = Open("/link?agent=7");
  const auto anna = Connect(7);
  EXPECT_EQ(TextOf(silent->Next()).size(), 32U);
  gateway_.SetNow(now_us_ + AgentSocket::kProofTime_us + 1);
  EXPECT_EQ(silent->Next(), std::nullopt);
  EXPECT_EQ(silent->Ending().value().code, 4408);
  EXPECT_EQ(anna->Next(), std::nullopt);
  EXPECT_EQ(anna->Ending(), std::nullopt);
}

TEST_F(GatewayTest, ASecondConnectionTakesThePlaceOfTheFirst) {
  auto first = Connect(7);
  gateway_.SendDown(7, BytesOf("old"));
  const auto second = Connect(7);
  EXPECT_EQ(first->Ending().value().code, 4409);
  EXPECT_EQ(first->Next(), std::nullopt);
  EXPECT_FALSE(first->Receive("late"));
  first.reset();
  gateway_.SendDown(7, BytesOf("new"));
  EXPECT_EQ(TextOf(second->Next()), "new");
  EXPECT_EQ(gateway_.num_connected(), 1);
}

TEST_F(GatewayTest, ARevokedOrChangedKeyEndsTheLink) {
  const auto anna = Connect(7);
  const auto ben = Connect(8);
  auto agents = Agents({7, 8});
  gateway_.SetAgents(agents);
  EXPECT_EQ(anna->Ending(), std::nullopt);
  agents.erase(7);
  agents.at(8).key = KeyOf(9);
  gateway_.SetAgents(agents);
  EXPECT_EQ(anna->Ending().value().code, 4401);
  EXPECT_EQ(ben->Ending().value().code, 4401);
  EXPECT_EQ(gateway_.num_connected(), 0);
}

TEST_F(GatewayTest, WhatWaitsToGoDownIsBoundedAndTheOldestGoes) {
  const auto anna = Connect(7);
  const std::string packet(1000, 'x');
  gateway_.SendDown(7, BytesOf("oldest"));
  for (size_t i = 0; i < LinkSocket::kMaxQueue_bytes / packet.size(); ++i) {
    gateway_.SendDown(7, BytesOf(packet));
  }
  EXPECT_EQ(dropped_, 1);
  EXPECT_EQ(TextOf(anna->Next()), packet);
  gateway_.SendDown(7, std::vector<uint8_t>(kMaxLinkPacketBytes + 1));
  size_t waiting = 0;
  while (const auto message = anna->Next()) {
    waiting += message->size();
  }
  EXPECT_EQ(waiting, LinkSocket::kMaxQueue_bytes - packet.size())
      << "what is no packet is not sent";
}

TEST_F(GatewayTest, WhatComesTooFastIsDropped) {
  const auto anna = Connect(7);
  const std::string packet(10'000, 'x');
  for (int i = 0; i < 200; ++i) {
    EXPECT_TRUE(anna->Receive(packet));
  }
  EXPECT_THAT(up_, SizeIs(100)) << "the burst";
  EXPECT_EQ(dropped_, 100);
  gateway_.SetNow(now_us_ + 100'000);
  EXPECT_TRUE(anna->Receive(packet));
  EXPECT_THAT(up_, SizeIs(101));
  EXPECT_FALSE(anna->Receive("")) << "no packet is empty";
}

TEST_F(GatewayTest, StrangersDoNotKeepAgentsOut) {
  std::vector<std::unique_ptr<web::WebPeer>> strangers;
  for (size_t i = 0; i <= Gateway::kMaxUnproven; ++i) {
    strangers.push_back(Open("/link?agent=7"));
  }
  EXPECT_EQ(strangers[0]->Ending().value().code, 4429);
  EXPECT_EQ(strangers[1]->Ending(), std::nullopt);
  const auto anna = Connect(7);
  EXPECT_EQ(anna->Ending(), std::nullopt);
}

TEST_F(GatewayTest, SoManyAgentsAtOnce) {
  std::vector<int32_t> ids;
  for (int32_t id = 1; id <= static_cast<int32_t>(Gateway::kMaxAgentsAtOnce) + 1; ++id) {
    ids.push_back(id);
  }
  gateway_.SetAgents(Agents(ids));
  std::vector<std::unique_ptr<web::WebPeer>> agents;
  for (size_t i = 0; i < Gateway::kMaxAgentsAtOnce; ++i) {
    agents.push_back(Connect(ids[i]));
  }
  const auto late = Open("/link?agent=" + std::to_string(ids.back()));
  EXPECT_FALSE(late->Receive(ProofFor(KeyOf(ids.back()), ids.back(), late.get())));
  EXPECT_EQ(late->Ending().value().code, 4429);
  const auto again = Connect(ids[0]);
  agents[1].reset();
  EXPECT_EQ(Connect(ids.back())->Ending(), std::nullopt);
}

TEST_F(GatewayTest, UploadsAreOfAgentsAndFew) {
  gateway_.SetAgents(Agents({1, 2, 3, 4, 5}));
  const auto stranger = Open("/recording?agent=1");
  EXPECT_FALSE(stranger->Receive(ProofFor(KeyOf(2), 1, stranger.get())));
  EXPECT_EQ(stranger->Ending().value().code, 4401);

  const std::string size = "\x64" + std::string(7, '\0');
  std::map<int32_t, std::unique_ptr<web::WebPeer>> uploads;
  for (int32_t id = 1; id <= static_cast<int32_t>(Gateway::kMaxUploads); ++id) {
    uploads[id] = Connect(id, "/recording");
    EXPECT_TRUE(uploads[id]->Receive(size));
  }
  EXPECT_EQ(gateway_.num_connected(), 0) << "its link is another socket";
  const auto late = Open("/recording?agent=5");
  EXPECT_FALSE(late->Receive(ProofFor(KeyOf(5), 5, late.get())));
  EXPECT_EQ(late->Ending().value().code, 4429);

  const auto again = Connect(1, "/recording");
  EXPECT_EQ(uploads[1]->Ending().value().code, 4409);
  uploads[2].reset();
  gateway_.SetAgents(Agents({4}));
  EXPECT_EQ(uploads[3]->Ending().value().code, 4401);
  EXPECT_EQ(store_.begun, std::set<int32_t>{4});
}

}  // namespace
}  // namespace pangea

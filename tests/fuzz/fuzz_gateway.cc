// Input from strangers to the gateway. The first byte selects a request to join, a target, an
// upload or a socket. Then follow a body, a target, messages of an upload (with a byte of length
// each), or a target's end and the messages on its socket.

#include <nlohmann/json.hpp>

#include "fuzz.h"
#include "gateway/gateway.h"
#include "link/link_session.h"

namespace pangea::fuzz {
namespace {

constexpr int32_t kVisitor = 7;

// Stores nothing, but checks the sizes that it was told.
class CountingStore : public RecordingStore {
 public:
  std::string Begin(int32_t agent_id, int64_t bytes) override {
    Require(agent_id == kVisitor && bytes > 0 && bytes <= RecordingSocket::kMaxRecording,
            "an upload is an agent's, and bounded");
    left_ = bytes;
    return "";
  }
  std::string Write(int32_t, Bytes data) override {
    left_ -= static_cast<int64_t>(data.size());
    Require(left_ >= 0, "no upload is larger than it was said to be");
    return "";
  }
  Kept Finish(int32_t) override {
    Require(left_ == 0, "what is kept is whole");
    return {"a.zip", ""};
  }
  void Abort(int32_t) override { left_ = 0; }

 private:
  int64_t left_ = 0;
};

class Strangers {
 public:
  Strangers()
      : gateway_({"hall", "pangea", {}, ""},
                 {[](const JoinRequest& request) { return Join(request); },
                  [](int32_t agent_id, Bytes packet) {
                    Require(agent_id == kVisitor, "packets are of the agent that proved its key");
                    Require(!packet.empty(), "no packet is empty");
                  },
                  [](const std::string& why) { Require(!why.empty(), "a refusal has a reason"); },
                  [] {}},
                 store_) {
    gateway_.SetNow(1'000'000);
    gateway_.SetAgents({{kVisitor, {key_, "Anna"}}});
  }

  void Ask(const web::WebRequest& request) {
    int answers = 0;
    gateway_.Answer(request, [&](const web::WebAnswer& answer) {
      ++answers;
      Require(answer.type != "application/json" || nlohmann::json::accept(answer.body),
              "an answer is JSON");
      Require(answer.status < 400 || !answer.body.empty(), "a refusal has a reason");
    });
    Require(answers == 1, "each request has one answer");
  }

  void Talk(const std::string& target_end, const std::string& said) {
    const auto socket = gateway_.Open({"GET", "/link?agent=" + target_end, "localhost", "", ""});
    if (socket == nullptr) {
      return;
    }
    socket->Next();
    Require(!socket->Receive(said), "nobody guesses a proof");
    Require(socket->Ending().has_value() && !socket->Next(), "the conversation is over");
  }

  void Send(const std::string& said) {
    const auto socket = Proven("/link");
    Require(socket->Receive(said) == !said.empty(), "the gateway opens no packet");
  }

  void Upload(std::string_view said) {
    const auto socket = Proven("/recording");
    bool goes_on = true;
    while (goes_on && !said.empty()) {
      const size_t length = std::min<size_t>(static_cast<uint8_t>(said[0]), said.size() - 1);
      goes_on = socket->Receive(said.substr(1, length));
      socket->Next();
      said.remove_prefix(1 + length);
    }
    Require(goes_on || socket->Ending().has_value(), "an end has a reason");
  }

 private:
  // A peer that has proven its agent's key.
  std::unique_ptr<web::WebPeer> Proven(const std::string& path) {
    auto socket =
        gateway_.Open({"GET", path + "?agent=" + std::to_string(kVisitor), "localhost", "", ""});
    GatewayNonce nonce{};
    const std::vector<uint8_t> sent = socket->Next().value();
    std::copy(sent.begin(), sent.end(), nonce.begin());
    const auto proof = GatewayProof(key_, kVisitor, nonce);
    Require(socket->Receive(std::string(proof.begin(), proof.end())), "a proof is taken");
    return socket;
  }

  static JoinResult Join(const JoinRequest& request) {
    Require(PlainJoinCode(request.code) == request.code && request.code.size() == kCodeLetters,
            "a code is plain");
    Require(IsVisitorName(request.name), "a name can be shown");
    return {JoinResult::kWrongCode, "no", 0, ""};
  }

  const SecretKey key_ = SecretKey::Random();
  CountingStore store_;
  Gateway gateway_;
};

}  // namespace
}  // namespace pangea::fuzz

static int FuzzGateway(const uint8_t* data, size_t size) {
  using namespace pangea;
  if (size == 0) {
    return 0;
  }
  const std::string text(data + 1, data + size);
  fuzz::Strangers strangers;
  if (data[0] == 'j') {
    strangers.Ask({"POST", "/v1/join", "localhost", "", text});
  } else if (data[0] == 't') {
    strangers.Ask({"GET", text, "localhost", "", ""});
  } else if (data[0] == 'r') {
    strangers.Upload(text);
  } else {
    const size_t line = std::min(text.find('\n'), text.size());
    const std::string said = text.substr(std::min(line + 1, text.size()));
    strangers.Talk(text.substr(0, line), said);
    strangers.Send(said);
  }
  return 0;
}
static const pangea::fuzz::Target kGateway("gateway", FuzzGateway);

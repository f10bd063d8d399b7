// What strangers say to the gateway: the first byte chooses a request to join or a socket; then a
// body, or a target's end and what is said on its socket.

#include <nlohmann/json.hpp>

#include "fuzz.h"
#include "gateway/gateway.h"
#include "link/link_session.h"

namespace pangea::fuzz {
namespace {

constexpr int32_t kAgent = 7;

class Strangers {
 public:
  Strangers()
      : gateway_({"hall", "pangea", {}, ""},
                 {[this](const JoinRequest& request) { return Join(request); },
                  [](int32_t agent_id, Bytes packet) {
                    Require(agent_id == kAgent, "packets are of the agent that proved its key");
                    Require(!packet.empty(), "no packet is empty");
                  },
                  [](const std::string& why) { Require(!why.empty(), "a refusal has a reason"); },
                  [] {}}) {
    gateway_.SetNow(1'000'000);
    gateway_.SetAgents({{kAgent, {key_, "Anna"}}});
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

  // Of an agent that has proven its key.
  void Send(const std::string& said) {
    const auto socket =
        gateway_.Open({"GET", "/link?agent=" + std::to_string(kAgent), "localhost", "", ""});
    GatewayNonce nonce{};
    const std::vector<uint8_t> sent = socket->Next().value();
    std::copy(sent.begin(), sent.end(), nonce.begin());
    const auto proof = GatewayProof(key_, kAgent, nonce);
    Require(socket->Receive(std::string(proof.begin(), proof.end())), "a proof is taken");
    Require(socket->Receive(said) == !said.empty(), "the gateway opens no packet");
  }

 private:
  static JoinResult Join(const JoinRequest& request) {
    Require(PlainJoinCode(request.code) == request.code && request.code.size() == kCodeLetters,
            "a code is plain");
    Require(IsVisitorName(request.name), "a name can be shown");
    return {JoinResult::kWrongCode, "no", 0, ""};
  }

  const SecretKey key_ = SecretKey::Random();
  Gateway gateway_;
};

}  // namespace
}  // namespace pangea::fuzz

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
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
  } else {
    const size_t line = std::min(text.find('\n'), text.size());
    const std::string said = text.substr(std::min(line + 1, text.size()));
    strangers.Talk(text.substr(0, line), said);
    strangers.Send(said);
  }
  return 0;
}

#include "gateway/agent_socket.h"

#include <fmt/format.h>
#include <sodium.h>

#include <utility>

namespace pangea {

static_assert(kProofBytes == crypto_auth_hmacsha256_BYTES);

std::array<uint8_t, kProofBytes> GatewayProof(const SecretKey& key, int32_t agent_id,
                                              const GatewayNonce& nonce) {
  const std::string prefix = fmt::format("pangea-gateway-v1:{}:", agent_id);
  std::vector<uint8_t> text(prefix.begin(), prefix.end());
  text.insert(text.end(), nonce.begin(), nonce.end());
  std::array<uint8_t, kProofBytes> proof;
  crypto_auth_hmacsha256(proof.data(), text.data(), text.size(), key.bytes().data());
  return proof;
}

AgentSocket::AgentSocket(AgentSocketOwner& owner, int32_t agent_id)
    : owner_(owner), agent_id_(agent_id), opened_us_(owner.now_us()) {
  randombytes_buf(nonce_.data(), nonce_.size());
}

AgentSocket::~AgentSocket() { owner_.OnGone(this); }

void AgentSocket::End(const web::WebEnding& ending) {
  if (!ending_) {
    ending_ = ending;
    owner_.OnRefused("socket: " + ending.reason);
  }
}

std::optional<std::vector<uint8_t>> AgentSocket::Next() {
  if (!std::exchange(nonce_sent_, true)) {
    return std::vector<uint8_t>(nonce_.begin(), nonce_.end());
  }
  if (!proven_ && owner_.now_us() > opened_us_ + kProofTime_us) {
    End(kNoProof);
  }
  return proven_ ? NextMessage() : std::nullopt;
}

bool AgentSocket::Receive(std::string_view message) {
  const Bytes bytes(reinterpret_cast<const uint8_t*>(message.data()), message.size());
  if (ending_) {
    return false;
  }
  if (proven_) {
    return ReceiveMessage(bytes);
  }
  proven_ = owner_.OnProof(this, bytes) && Begin();
  return proven_;
}

}  // namespace pangea

#include "gateway/link_socket.h"

#include <fmt/format.h>
#include <sodium.h>

#include <utility>

#include "link/link_session.h"

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

LinkSocket::LinkSocket(LinkSocketOwner& owner, int32_t agent_id)
    : owner_(owner), agent_id_(agent_id), opened_us_(owner.now_us()) {
  randombytes_buf(nonce_.data(), nonce_.size());
}

LinkSocket::~LinkSocket() { owner_.OnGone(this); }

size_t LinkSocket::max_message_bytes() const { return kMaxLinkPacketBytes; }

void LinkSocket::End(const web::WebEnding& ending) {
  if (!ending_) {
    ending_ = ending;
    owner_.OnRefused("socket: " + ending.reason);
  }
  queue_.clear();
  queue_bytes_ = 0;
}

void LinkSocket::SendDown(Bytes packet) {
  if (!proven_ || ending_ || packet.size() > kMaxLinkPacketBytes) {
    return;
  }
  queue_.emplace_back(packet.begin(), packet.end());
  queue_bytes_ += packet.size();
  while (queue_bytes_ > kMaxQueue_bytes) {
    queue_bytes_ -= queue_.front().size();
    queue_.pop_front();
    owner_.OnDropped();
  }
}

std::optional<std::vector<uint8_t>> LinkSocket::Next() {
  if (!std::exchange(nonce_sent_, true)) {
    return std::vector<uint8_t>(nonce_.begin(), nonce_.end());
  }
  if (!proven_ && owner_.now_us() > opened_us_ + kProofTime_us) {
    End(kNoProof);
  }
  if (queue_.empty()) {
    return std::nullopt;
  }
  std::vector<uint8_t> packet = std::move(queue_.front());
  queue_.pop_front();
  queue_bytes_ -= packet.size();
  return packet;
}

bool LinkSocket::Receive(std::string_view message) {
  const Bytes bytes(reinterpret_cast<const uint8_t*>(message.data()), message.size());
  if (ending_) {
    return false;
  }
  if (proven_) {
    return ReceivePacket(bytes);
  }
  proven_ = owner_.OnProof(this, bytes);
  return proven_;
}

bool LinkSocket::ReceivePacket(Bytes packet) {
  if (packet.empty()) {
    End(kGarbage);
    return false;
  }
  rate_.Refill(owner_.now_us());
  if (rate_.Ready()) {
    rate_.Take(static_cast<int64_t>(packet.size()));
    owner_.OnPacketUp(agent_id_, packet);
  } else {
    owner_.OnDropped();
  }
  return true;
}

std::optional<web::WebEnding> LinkSocket::Ending() const { return ending_; }

}  // namespace pangea

#include "gateway/link_socket.h"

#include <utility>

#include "link/link_session.h"

namespace pangea {

size_t LinkSocket::max_message_bytes() const { return kMaxLinkPacketBytes; }

void LinkSocket::End(const web::WebEnding& ending) {
  AgentSocket::End(ending);
  queue_.clear();
  queue_bytes_ = 0;
}

void LinkSocket::SendDown(Bytes packet) {
  if (!proven() || Ending() || packet.size() > kMaxLinkPacketBytes) {
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

std::optional<std::vector<uint8_t>> LinkSocket::NextMessage() {
  if (queue_.empty()) {
    return std::nullopt;
  }
  std::vector<uint8_t> packet = std::move(queue_.front());
  queue_.pop_front();
  queue_bytes_ -= packet.size();
  return packet;
}

bool LinkSocket::ReceiveMessage(Bytes packet) {
  if (packet.empty()) {
    End(kGarbage);
    return false;
  }
  rate_.Refill(now_us());
  if (rate_.Ready()) {
    rate_.Take(static_cast<int64_t>(packet.size()));
    owner_.OnPacketUp(agent_id(), packet);
  } else {
    owner_.OnDropped();
  }
  return true;
}

}  // namespace pangea

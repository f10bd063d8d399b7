#pragma once

// An agent's link over a WebSocket: sealed link packets in both directions, one per message. They
// are not decrypted here. Bounded: kMaxQueue_bytes wait to go down (beyond that the oldest packet
// is dropped, because the link repeats what is lost), and kRate_bytes_per_s come up (beyond that,
// packets are dropped).

#include <deque>
#include <vector>

#include "gateway/agent_socket.h"
#include "link/pacer.h"

namespace pangea {

inline const web::WebEnding kGarbage{4400, "this is no link packet"};

class LinkSocket;

class LinkSocketOwner : public AgentSocketOwner {
 public:
  // Makes this socket the agent's link. False if the socket has been ended instead.
  virtual bool OnLink(LinkSocket* socket) = 0;
  virtual void OnPacketUp(int32_t agent_id, Bytes packet) = 0;
  virtual void OnDropped() = 0;  // a packet was dropped
};

class LinkSocket : public AgentSocket {
 public:
  static constexpr size_t kMaxQueue_bytes = 256'000;
  static constexpr double kRate_bytes_per_s = 4e6;  // the default bandwidth of an uplink
  static constexpr double kBurst_bytes = 1e6;

  LinkSocket(LinkSocketOwner& owner, int32_t agent_id)
      : AgentSocket(owner, agent_id), owner_(owner) {}

  void End(const web::WebEnding& ending) override;
  void SendDown(Bytes packet);
  size_t max_message_bytes() const override;

 private:
  bool Begin() override { return owner_.OnLink(this); }
  std::optional<std::vector<uint8_t>> NextMessage() override;
  bool ReceiveMessage(Bytes packet) override;

  LinkSocketOwner& owner_;
  std::deque<std::vector<uint8_t>> queue_;
  size_t queue_bytes_ = 0;
  Pacer rate_{kRate_bytes_per_s, kBurst_bytes};
};

}  // namespace pangea

#pragma once

// An agent's link over a WebSocket: sealed link packets both ways, a message each. Nothing is
// opened here. Bounded: kMaxQueue_bytes wait to go down (the oldest is dropped for a new one: the
// link repeats what counts), kRate_bytes_per_s come up (what is beyond is dropped).

#include <deque>
#include <vector>

#include "gateway/agent_socket.h"
#include "link/pacer.h"

namespace pangea {

inline const web::WebEnding kGarbage{4400, "this is no link packet"};

class LinkSocket;

class LinkSocketOwner : public AgentSocketOwner {
 public:
  // Whether the agent's link is this one from now on; else it has been ended.
  virtual bool OnLink(LinkSocket* socket) = 0;
  virtual void OnPacketUp(int32_t agent_id, Bytes packet) = 0;
  virtual void OnDropped() = 0;  // a packet
};

class LinkSocket : public AgentSocket {
 public:
  static constexpr size_t kMaxQueue_bytes = 256'000;
  static constexpr double kRate_bytes_per_s = 4e6;  // as an uplink sends at most by default
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

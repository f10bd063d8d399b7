#pragma once

// One agent's WebSocket: a nonce down, proof of the agent's key up, then sealed link packets both
// ways, a message each. Nothing is opened here. Bounded: kMaxQueue_bytes wait to go down (the
// oldest is dropped for a new one: the link repeats what counts), kRate_bytes_per_s come up (what
// is beyond is dropped).

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "link/pacer.h"
#include "link/seal.h"
#include "web/web_site.h"

namespace pangea {

// HMAC-SHA-256 under the agent's key of "pangea-gateway-v1:", the agent's id in decimal digits, ":"
// and the nonce's bytes.
inline constexpr size_t kProofBytes = 32;
using GatewayNonce = std::array<uint8_t, 32>;
std::array<uint8_t, kProofBytes> GatewayProof(const SecretKey& key, int32_t agent_id,
                                              const GatewayNonce& nonce);

// Why a conversation was ended, for the page.
inline const web::WebEnding kNotKnown{4401, "the key is wrong, or was revoked"};
inline const web::WebEnding kNoProof{4408, "no proof of a key within 5 s"};
inline const web::WebEnding kReplaced{4409, "another connection of this agent took its place"};
inline const web::WebEnding kTooMany{4429, "too many are connected"};
inline const web::WebEnding kGarbage{4400, "this is no link packet"};

class LinkSocket;

// Who opens link sockets; outlives them.
class LinkSocketOwner {
 public:
  virtual ~LinkSocketOwner() = default;
  // Whether the socket is its agent's from now on; else it has been ended.
  virtual bool OnProof(LinkSocket* socket, Bytes proof) = 0;
  virtual void OnPacketUp(int32_t agent_id, Bytes packet) = 0;
  virtual void OnRefused(const std::string& why) = 0;
  virtual void OnDropped() = 0;  // a packet
  virtual void OnGone(LinkSocket* socket) = 0;
  virtual int64_t now_us() const = 0;
};

class LinkSocket : public web::WebPeer {
 public:
  static constexpr int64_t kProofTime_us = 5'000'000;
  static constexpr size_t kMaxQueue_bytes = 256'000;
  static constexpr double kRate_bytes_per_s = 4e6;  // as an uplink sends at most by default
  static constexpr double kBurst_bytes = 1e6;

  LinkSocket(LinkSocketOwner& owner, int32_t agent_id);
  ~LinkSocket() override;
  LinkSocket(const LinkSocket&) = delete;
  LinkSocket& operator=(const LinkSocket&) = delete;

  int32_t agent_id() const { return agent_id_; }
  const GatewayNonce& nonce() const { return nonce_; }
  bool proven() const { return proven_; }
  void End(const web::WebEnding& ending);
  void SendDown(Bytes packet);

  bool is_text() const override { return false; }
  size_t max_message_bytes() const override;
  std::optional<std::vector<uint8_t>> Next() override;
  bool Receive(std::string_view message) override;
  std::optional<web::WebEnding> Ending() const override;

 private:
  bool ReceivePacket(Bytes packet);

  LinkSocketOwner& owner_;
  const int32_t agent_id_;
  const int64_t opened_us_;
  GatewayNonce nonce_;
  bool nonce_sent_ = false;
  bool proven_ = false;
  std::optional<web::WebEnding> ending_;
  std::deque<std::vector<uint8_t>> queue_;
  size_t queue_bytes_ = 0;
  Pacer rate_{kRate_bytes_per_s, kBurst_bytes};
};

}  // namespace pangea

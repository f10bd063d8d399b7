#pragma once

// The WebSocket of one agent. The server sends a nonce, the agent proves that it has its key, then
// the subclass' messages follow.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "link/seal.h"
#include "web/web_site.h"

namespace pangea {

// The proof: HMAC-SHA-256, with the agent's key, of "pangea-gateway-v1:", the agent's id in decimal
// digits, ":" and the nonce's bytes.
inline constexpr size_t kProofBytes = 32;
using GatewayNonce = std::array<uint8_t, 32>;
std::array<uint8_t, kProofBytes> GatewayProof(const SecretKey& key, int32_t agent_id,
                                              const GatewayNonce& nonce);

// The reasons for closing a socket, for the page.
inline const web::WebEnding kNotKnown{4401, "the key is wrong, or was revoked"};
inline const web::WebEnding kNoProof{4408, "no proof of a key within 5 s"};
inline const web::WebEnding kReplaced{4409, "another connection of this agent took its place"};
inline const web::WebEnding kTooMany{4429, "too many are connected"};

class AgentSocket;

// The owner of sockets; it must outlive them.
class AgentSocketOwner {
 public:
  virtual ~AgentSocketOwner() = default;
  // Returns whether the proof is right; if not, it has ended the socket.
  virtual bool OnProof(AgentSocket* socket, Bytes proof) = 0;
  virtual void OnRefused(const std::string& why) = 0;
  virtual void OnGone(AgentSocket* socket) = 0;
  virtual int64_t now_us() const = 0;
};

class AgentSocket : public web::WebPeer {
 public:
  static constexpr int64_t kProofTime_us = 5'000'000;

  AgentSocket(AgentSocketOwner& owner, int32_t agent_id);
  ~AgentSocket() override;
  AgentSocket(const AgentSocket&) = delete;
  AgentSocket& operator=(const AgentSocket&) = delete;

  int32_t agent_id() const { return agent_id_; }
  const GatewayNonce& nonce() const { return nonce_; }
  bool proven() const { return proven_; }
  // Closes the socket because of an error. Waiting messages are not sent any more.
  virtual void End(const web::WebEnding& ending);

  bool is_text() const final { return false; }
  std::optional<std::vector<uint8_t>> Next() final;
  bool Receive(std::string_view message) final;
  std::optional<web::WebEnding> Ending() const final { return ending_; }

 protected:
  // Called when the key is proven. Returns false if the socket has been ended nevertheless.
  virtual bool Begin() = 0;
  virtual std::optional<std::vector<uint8_t>> NextMessage() = 0;
  virtual bool ReceiveMessage(Bytes message) = 0;

  // Closes the socket normally.
  void Finish(const web::WebEnding& ending) { ending_ = ending; }
  int64_t now_us() const { return owner_.now_us(); }

 private:
  AgentSocketOwner& owner_;
  const int32_t agent_id_;
  const int64_t opened_us_;
  GatewayNonce nonce_;
  bool nonce_sent_ = false;
  bool proven_ = false;
  std::optional<web::WebEnding> ending_;
};

}  // namespace pangea

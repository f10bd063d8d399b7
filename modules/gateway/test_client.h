#pragma once

// For tests: the agent's end of a gateway socket, over TLS.

#include <fmt/format.h>

#include <string>
#include <vector>

#include "gateway/link_socket.h"
#include "web/testing/tls_client.h"
#include "web/testing/web_client.h"

namespace pangea {

class GatewayAgent {
 public:
  GatewayAgent(uint16_t port, int32_t agent_id, const SecretKey& key,
               const std::string& authority_pem = "", const std::string& path = "/link")
      : client_(port, authority_pem), agent_id_(agent_id), key_(key) {
    client_.Send(web::UpgradeRequest(fmt::format("{}?agent={}", path, agent_id), ""));
  }

  void Send(Bytes packet) {
    client_.Send(web::MaskedFrame(std::string(packet.begin(), packet.end()), web::Frame::kBinary));
  }

  // The packets received since the last call. Also answers the nonce.
  std::vector<std::string> Received() {
    received_ += client_.Received();
    TakeAnswer();
    std::vector<std::string> packets;
    for (web::Frame& frame : upgraded_ ? web::TakeFrames(&received_) : std::vector<web::Frame>()) {
      if (frame.opcode == web::Frame::kClose) {
        close_code_ =
            static_cast<uint8_t>(frame.payload[0]) << 8 | static_cast<uint8_t>(frame.payload[1]);
        close_reason_ = frame.payload.substr(2);
      } else if (!proven_) {
        Prove(frame.payload);
      } else if (frame.opcode == web::Frame::kBinary) {
        packets.push_back(std::move(frame.payload));
      }
    }
    return packets;
  }
  bool proven() const { return proven_; }
  int close_code() const { return close_code_; }  // 0: open
  const std::string& close_reason() const { return close_reason_; }

 private:
  void TakeAnswer() {
    const size_t end = received_.find("\r\n\r\n");
    if (!upgraded_ && end != std::string::npos) {
      EXPECT_TRUE(received_.starts_with("HTTP/1.1 101")) << received_;
      upgraded_ = true;
      received_.erase(0, end + 4);
    }
  }
  void Prove(const std::string& sent) {
    GatewayNonce nonce{};
    ASSERT_EQ(sent.size(), nonce.size());
    std::copy(sent.begin(), sent.end(), nonce.begin());
    Send(GatewayProof(key_, agent_id_, nonce));
    proven_ = true;
  }

  web::TlsClient client_;
  const int32_t agent_id_;
  const SecretKey key_;
  std::string received_;
  bool upgraded_ = false;
  bool proven_ = false;
  int close_code_ = 0;
  std::string close_reason_;
};

}  // namespace pangea

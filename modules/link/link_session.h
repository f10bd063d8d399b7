#pragma once

// Both ends' sessions of the agent link: which packets are opened, and under which key.
//
// A hello is sealed under the agent's pre-shared key. It carries the uplink's run, drawn at random
// at its start, and the handler's run it believes in. A handler that does not know this pair
// answers with a welcome: a random run it has never used, and the number of the hello, so that only
// a fresh welcome counts. A hello that names this new run proves that its uplink is alive now:
// from then on everything else is sealed under keys derived from both runs, each packet with a
// number of its own. Nothing recorded before can be opened any more, after restarts neither.
//
// State machines: bytes in, bytes out; no clock, no bus, one thread. Randomness is libsodium's.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "link/seal.h"

namespace pangea {

// First byte of a packet. Up: to 15; down: from 16.
enum class LinkKind : uint8_t {
  kHello = 1,
  kPiece = 2,      // of a keyframe
  kLastPiece = 3,  // of a keyframe: its index says how many there are
  kPose = 4,
  kAnchorEdit = 5,
  kAnchorsReceived = 6,
  kWelcome = 16,
  kAck = 17,
  kLandmarks = 18,
  kAnchor = 19,
  kAnchorEditAnswers = 20,
  kOthers = 21,
};

struct LinkPacket {
  LinkKind kind = LinkKind::kHello;
  int64_t number =
      0;  // of this transmission, from 1; up: in the uplink's run, down: in the session
  std::vector<uint8_t> body;
};

// Of a packet in a session: kind, low bits of the number, tag.
inline constexpr int kSessionOverheadBytes = 1 + 3 + kSealTagBytes;

// What is larger is none of ours, and is not even opened.
inline constexpr size_t kMaxLinkPacketBytes = 40'000;

// Why a hello is refused: it was sealed under another key, or changed on its way.
inline constexpr char kHelloNotOpened[] = "hello is forged or damaged";

// One direction of a session.
struct SessionKey {
  SecretKey key;
  ReplayWindow window;

  std::vector<uint8_t> Seal(const LinkPacket& packet) const;
  // Nothing, and why, unless it is whole, fresh and sealed under this key.
  std::optional<LinkPacket> Open(Bytes bytes, std::string* refused);
};

class UplinkSession {
 public:
  UplinkSession(int32_t agent_id, const SecretKey& agent_key);

  struct Opened {
    std::optional<LinkPacket> packet;  // of the session
    bool new_session = false;          // what was said before may never have been heard
    std::string refused;
  };
  Opened Open(Bytes bytes);
  // A hello always; anything else once there is a session.
  std::vector<uint8_t> Seal(const LinkPacket& packet);

 private:
  Opened OnWelcome(Bytes bytes);

  const int32_t agent_id_;
  const SecretKey agent_key_;
  const SecretKey hello_key_;
  const SecretKey welcome_key_;
  const uint64_t run_;
  uint64_t handler_run_ = 0;
  int64_t last_hello_ = 0;
  int64_t answered_hello_ = 0;  // a welcome counts if it answers a later one
  std::optional<SessionKey> up_, down_;
};

class HandlerSession {
 public:
  HandlerSession(int32_t agent_id, const SecretKey& agent_key);

  struct Opened {
    std::optional<LinkPacket> packet;
    bool new_uplink = false;       // another run of the uplink than before
    bool two_uplinks = false;      // ... which an earlier session was with: both are alive
    std::vector<uint8_t> welcome;  // to be sent back, unless it is empty
    std::string refused;
  };
  Opened Open(Bytes bytes);

  bool HasUplink() const { return up_.has_value(); }
  // Numbers the packets itself. Only with an uplink.
  std::vector<uint8_t> Seal(LinkKind kind, std::vector<uint8_t> body);
  const SecretKey& agent_key() const { return agent_key_; }

 private:
  struct Hello {
    uint64_t uplink_run = 0;
    uint64_t handler_run = 0;
    LinkPacket packet;
  };
  std::optional<Hello> OpenHello(Bytes bytes) const;
  std::vector<uint8_t> Welcome(const Hello& hello) const;
  Opened OnHello(Bytes bytes);

  int32_t agent_id_;
  SecretKey agent_key_;
  SecretKey hello_key_;
  SecretKey welcome_key_;
  uint64_t uplink_run_ = 0;
  uint64_t earlier_uplink_run_ = 0;
  uint64_t run_ = 0;
  uint64_t next_run_ = RandomNumber();  // offered in welcomes; used up by a session
  std::optional<SessionKey> up_, down_;
  int64_t last_number_ = 0;
};

}  // namespace pangea

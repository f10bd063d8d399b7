#pragma once

// The sessions of both ends of the agent link: which packets are accepted, and under which key.
//
// A hello is sealed under a key derived from the agent's pre-shared key. It has the uplink's run (a
// random number drawn at its start) and the handler's run that the uplink last learnt. If the
// handler does not know this pair, it answers with a welcome: a new random run, and the number of
// the hello, so that the uplink accepts only fresh welcomes. A hello with this new run proves that
// its uplink is alive now. From then on all other packets are sealed under keys derived from both
// runs, each with its own number. So packets recorded earlier can never be replayed, also not after
// restarts.
//
// State machines: bytes in, bytes out; no clock, no bus; not thread safe. Random numbers are
// libsodium's.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "link/seal.h"

namespace pangea {

// The first byte of a packet: up to 15 from the uplink, from 16 on from the handler.
enum class LinkKind : uint8_t {
  kHello = 1,
  kPiece = 2,      // a piece of a keyframe
  kLastPiece = 3,  // the last piece of a keyframe: its index tells the number of pieces
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
  // Number of this transmission, from 1: counts in the uplink's run (up) or in the session (down).
  int64_t number = 0;
  std::vector<uint8_t> body;
};

// Overhead of a packet in a session: kind, low bits of the number, tag.
inline constexpr int kSessionOverheadBytes = 1 + 3 + kSealTagBytes;

// Larger packets are not ours and are refused without opening them.
inline constexpr size_t kMaxLinkPacketBytes = 40'000;

// The reason when a hello cannot be opened: it was sealed under another key, or changed on its way.
inline constexpr char kHelloNotOpened[] = "hello is forged or damaged";

// The key of one direction of a session, and the numbers already received.
struct SessionKey {
  SecretKey key;
  ReplayWindow window;

  std::vector<uint8_t> Seal(const LinkPacket& packet) const;
  // Nothing, with the reason in `refused`, unless the packet is fresh and sealed under this key.
  std::optional<LinkPacket> Open(Bytes bytes, std::string* refused);
};

class UplinkSession {
 public:
  UplinkSession(int32_t agent_id, const SecretKey& agent_key);

  struct Opened {
    std::optional<LinkPacket> packet;  // a packet of the session
    bool new_session = false;          // the handler may not have received what was sent before
    bool two_handlers = false;         // another one welcomed us, and the session's one is alive
    std::string refused;
  };
  // `connected`: the session's handler answered lately. Then no welcome replaces the session: else
  // two handlers that have the agent's key would in turn acknowledge parts of the keyframes.
  Opened Open(Bytes bytes, bool connected = false);
  // A hello can always be sealed, other packets only in a session; else throws std::logic_error.
  std::vector<uint8_t> Seal(const LinkPacket& packet);

 private:
  Opened OnWelcome(Bytes bytes, bool connected);

  const int32_t agent_id_;
  const SecretKey agent_key_;
  const SecretKey hello_key_;
  const SecretKey welcome_key_;
  const uint64_t run_;
  uint64_t handler_run_ = 0;
  int64_t last_hello_ = 0;
  int64_t answered_hello_ = 0;  // only welcomes to later hellos are accepted
  bool other_welcomed_ = false;
  std::optional<SessionKey> up_, down_;
};

class HandlerSession {
 public:
  HandlerSession(int32_t agent_id, const SecretKey& agent_key);

  struct Opened {
    std::optional<LinkPacket> packet;
    bool new_uplink = false;       // the session is with another run of the uplink than before
    bool two_uplinks = false;      // this run had an earlier session: two uplinks are alive
    std::vector<uint8_t> welcome;  // to be sent back if not empty
    std::string refused;
  };
  Opened Open(Bytes bytes);

  bool HasUplink() const { return up_.has_value(); }
  // Gives the packet its number. Throws std::logic_error without an uplink.
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
  uint64_t next_run_ = RandomNumber();  // offered in welcomes; each session uses a new one
  std::optional<SessionKey> up_, down_;
  int64_t last_number_ = 0;
};

}  // namespace pangea

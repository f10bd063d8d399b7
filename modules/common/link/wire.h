#pragma once

// What crosses the agent link, as domain types: packets up, acknowledgements down. Like
// common/messages.h, this is a border: past Parse every field is bounded.
//
// A keyframe's encoded bytes are cut into pieces of one size, each a packet of its own (paper,
// IV.A: "we divide the packet ... artificially"; 4 KiB there, one Ethernet frame by default here).

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/bus/bus.h"
#include "common/messages.h"
#include "pangea/link_ack_t.hpp"
#include "pangea/link_hello_t.hpp"
#include "pangea/link_packet_t.hpp"

namespace pangea {

// A keyframe has to fit one LCM datagram.
inline constexpr int kMaxKeyframeBytes = 60'000;
inline constexpr int kMinPayloadBytes = 256;
inline constexpr int kMaxPayloadBytes = 30'000;
// Keyframes one agent may have in the receive cache, and maps a hello or an acknowledgement names:
// so that both fit one Ethernet frame.
inline constexpr int kMaxPartialKeyframes = 16;
inline constexpr int kMaxLinkMaps = 20;
inline constexpr int kMaxAckMaps = 40;
inline constexpr int kMaxLinkCorrections = 1;
// What UDP, IP and LCM's small-message header (8 bytes, channel, 0) add to a packet of bytes.
inline constexpr int kDatagramOverheadBytes = 28 + 8 + 12;

struct LinkPacket {
  enum class Kind : int8_t { kHello = 1, kKeyframe = 2, kPose = 3 };
  int32_t agent_id = 0;
  int64_t run = 0;     // wall clock at the sender's start, microseconds
  int64_t number = 0;  // of this transmission in the run, from 1
  Kind kind = Kind::kHello;
  KeyframeId keyframe;  // kKeyframe only
  int index = 0;        // piece `index` of `count`
  int count = 1;
  int offset = 0;       // bytes; where the piece lies in the message
  int total_bytes = 0;  // of the whole message
  uint32_t crc32 = 0;
  std::vector<uint8_t> data;
};

struct LinkMap {
  MapId map;
  int32_t first_seq = 0;  // keyframes before are lost for good, unless they are journalled
  int64_t correction_revision = 0;
};

struct LinkHello {
  std::string software;
  std::vector<LinkMap> maps;
};

struct LinkAck {
  int32_t agent_id = 0;
  int64_t run = 0;
  int64_t number = 0;
  int64_t uplink_run = 0;
  int64_t highest_number = 0;
  int cache_bytes = 0;
  std::map<MapId, int32_t> journalled_seq;             // -1: none
  std::map<KeyframeId, std::vector<uint8_t>> partial;  // bit i: piece i is there
  std::vector<Correction> corrections;
};

link_packet_t ToMessage(const LinkPacket& packet);
link_hello_t ToMessage(const LinkHello& hello);
link_ack_t ToMessage(const LinkAck& ack);

Parsed<LinkPacket> Parse(const link_packet_t& message);
Parsed<LinkHello> Parse(const link_hello_t& message);
Parsed<LinkAck> Parse(const link_ack_t& message);

uint32_t Crc32(Bytes data);

template <typename Message>
std::vector<uint8_t> EncodeMessage(const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

// A message of `total_bytes` cut into pieces of `payload_bytes`.
int NumPieces(int total_bytes, int payload_bytes);
Bytes Piece(Bytes message, int payload_bytes, int index);

}  // namespace pangea

#pragma once

// The packets of the agent link: domain types, and their compact bodies (link_session.h seals
// these). As in messages/messages.h, after Parse every field is within bounds.
//
// A keyframe's encoded bytes are compressed and cut into pieces, each in its own packet (paper,
// IV.B: "we divide the packet ... artificially"; 4 KiB there, one Ethernet frame by default here).
//   hello: software, count, and of each map: slot, opened_utime, first_seq, correction_revision
//   piece: slot of the map, low byte of seq, index; the rest is a piece of the keyframe
//   pose:  a pose_t in single precision
//   ack:   highest_number, cache_bytes; count, and of each map: opened_utime, journalled_seq + 1;
//          count, and of each keyframe in the cache: index of its map, seq, bits of its pieces;
//          count, and of each correction: an encoded correction_t
//   landmarks: an encoded landmarks_t; never sent again if it is lost
//   others: an encoded others_t; never sent again if it is lost, the newest counts
// Anchors (anchor_wire.h); edits and anchors are sent again until the other end confirms them:
//   anchor edit (up):          an encoded anchor_edit_t
//   anchor edit answers (down): count, and of each: agent_id and created_utime of the anchor,
//                              revision, 1 if it is in the journal or 0 if it was refused
//   anchor (down):             number, an encoded anchor_t
//   anchors received (up):     count, and each number

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bus/transport/udpm_assembler.h"
#include "core/bytes.h"
#include "link/link_session.h"
#include "messages/messages.h"
#include "pangea/pose_t.hpp"

namespace pangea {

// The bus of the link unless uplink and agent handler are given another one.
inline constexpr char kDefaultLinkUrl[] = "udpm://239.255.76.68:7668?ttl=1&recv_buf_size=4194304";

// A keyframe must fit one LCM datagram. Compression may make it a little larger.
inline constexpr int kMaxKeyframeBytes = 60'000;
inline constexpr int kMaxCompressedBytes = kMaxKeyframeBytes + kMaxKeyframeBytes / 128;
inline constexpr int kMinPayloadBytes = 256;
inline constexpr int kMaxPayloadBytes = 30'000;
inline constexpr int kMaxPieces = kMaxCompressedBytes / kMinPayloadBytes + 1;
static_assert(kMaxPieces <= 256);
static_assert(kMaxPayloadBytes + 1000 < kMaxLinkPacketBytes);
// None of our link packets needs LCM fragments, so the link's buses can refuse fragments.
static_assert(kMaxLinkPacketBytes + UdpmAssembler::kMaxChannel + 1 <= kMaxUdpmShortBytes);
// Bounds that let a hello and an acknowledgement fit one Ethernet frame. kMaxPartialKeyframes is
// the number of incomplete keyframes of one agent in the receive cache.
inline constexpr int kMaxPartialKeyframes = 32;
inline constexpr int kMaxLinkMaps = 20;
inline constexpr size_t kMaxSoftwareName = 40;
inline constexpr int kMaxAckMaps = 40;
inline constexpr int kMaxLinkCorrections = 1;
// Bounds for an encoded landmarks_t or others_t, so that it fits one Ethernet frame.
inline constexpr int kMaxLandmarksBytes = 1300;
inline constexpr int kMaxOthersBytes = 1300;

// A packet's bytes on the wire include the headers of IP, UDP and LCM's short messages (8 bytes,
// the channel, a 0 byte). IP fragments what is larger than an Ethernet frame, and each fragment has
// its own IP header.
inline constexpr int kIpBytes = 20;
inline constexpr int kUdpIpBytes = kIpBytes + 8;
inline constexpr int kLcmHeaderBytes = 8;
inline constexpr int kFrameBytes = 1500;
inline int BytesOnTheWire(const std::string& channel, Bytes packet) {
  constexpr int kFragmentBytes = kFrameBytes - kIpBytes;
  const int udp_bytes = kUdpIpBytes - kIpBytes + kLcmHeaderBytes +
                        static_cast<int>(channel.size()) + 1 + static_cast<int>(packet.size());
  return udp_bytes + kIpBytes * ((udp_bytes + kFragmentBytes - 1) / kFragmentBytes);
}
// Keyframe bytes in a packet that fills an Ethernet frame, for the longest agent id.
inline constexpr int kPieceHeaderBytes = 3;
inline constexpr int kFramePayloadBytes = kFrameBytes - kUdpIpBytes - kLcmHeaderBytes -
                                          static_cast<int>(sizeof("LINK_UP_65535")) -
                                          kSessionOverheadBytes - kPieceHeaderBytes;

struct LinkMap {
  MapId map;
  int32_t first_seq = 0;  // keyframes before this are lost for good, unless they are journalled
  int64_t correction_revision = 0;
  uint8_t slot = 0;  // names the map in pieces; unique in the hello
};

// This program's name and version, for the hello.
std::string OurSoftware();

struct LinkHello {
  std::string software;       // of the uplink: printable, at most kMaxSoftwareName characters
  std::vector<LinkMap> maps;  // the last one is the map that the agent is in
};

struct LinkPiece {
  uint8_t slot = 0;
  uint8_t seq_low = 0;  // low byte of seq; the few keyframes under way all differ in it
  int index = 0;
  bool last = false;
  Bytes data;
};

struct LinkAck {
  int64_t number = 0;          // of this packet; the acknowledgement with the highest counts
  int64_t highest_number = 0;  // highest number of the uplink's packets that was received
  int cache_bytes = 0;
  std::map<MapId, int32_t> journalled_seq;             // -1: none
  std::map<KeyframeId, std::vector<uint8_t>> partial;  // bit i: piece i was received
  std::vector<Correction> corrections;
};

std::vector<uint8_t> Encode(const LinkHello& hello);
std::vector<uint8_t> Encode(const LinkPiece& piece);
std::vector<uint8_t> Encode(const LinkAck& ack);
std::vector<uint8_t> EncodePose(const pose_t& pose);

// `agent_id`: the agent of the link; all ids in the packet become that agent's.
Parsed<LinkHello> ParseHello(int32_t agent_id, Bytes body);
Parsed<LinkPiece> ParsePiece(const LinkPacket& packet);  // its data points into the packet
Parsed<LinkAck> ParseAck(int32_t agent_id, const LinkPacket& packet);
Parsed<pose_t> ParsePose(int32_t agent_id, Bytes body);

// Cutting a message into pieces of `payload_bytes` (the last one may be shorter).
int NumPieces(int total_bytes, int payload_bytes);
Bytes Piece(Bytes message, int payload_bytes, int index);

}  // namespace pangea

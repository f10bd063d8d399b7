#pragma once

// What crosses the agent link of anchors: bodies of packets, laid out as wire.h says. Past Parse
// every field is bounded. Each body fits one Ethernet frame.

#include <cstdint>
#include <vector>

#include "link/wire.h"
#include "messages/anchor_messages.h"

namespace pangea {

// Of an encoded anchor_edit_t or anchor_t with the longest name and payload there may be.
inline constexpr int kMaxAnchorBytes = 1400;
inline constexpr int kMaxAnchorNumberBytes = 9;
static_assert(kMaxAnchorBytes + kMaxAnchorNumberBytes < kFramePayloadBytes);
inline constexpr size_t kMaxAnchorsReceived = 128;
inline constexpr size_t kMaxAnchorEditAnswers = 60;
// Edits up, and anchors down, at most: bytes on the wire per second, repeats included.
inline constexpr double kAnchorBytesPerSecond = 4000;

// Where an anchor is, as the number-th content that this agent's anchors had.
struct LinkAnchor {
  int64_t number = 0;  // from 1; the highest of an anchor counts
  AnchorState state;
};

// What became of an edit.
struct AnchorEditAnswer {
  AnchorId anchor;
  int64_t revision = 0;
  bool journalled = false;  // false: refused, and not to be sent again
};

std::vector<uint8_t> EncodeAnchorEdit(const AnchorEdit& edit);
// `message`: an encoded anchor_t.
std::vector<uint8_t> EncodeAnchor(int64_t number, Bytes message);
std::vector<uint8_t> EncodeAnchorsReceived(const std::vector<int64_t>& numbers);
std::vector<uint8_t> EncodeAnchorEditAnswers(const std::vector<AnchorEditAnswer>& answers);

// `agent_id`: whose link it came over, and whose edit, or map, it has to be.
Parsed<AnchorEdit> ParseAnchorEdit(int32_t agent_id, Bytes body);
Parsed<LinkAnchor> ParseAnchor(int32_t agent_id, Bytes body);
Parsed<std::vector<int64_t>> ParseAnchorsReceived(Bytes body);
Parsed<std::vector<AnchorEditAnswer>> ParseAnchorEditAnswers(Bytes body);

}  // namespace pangea

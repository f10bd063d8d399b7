#pragma once

// The bodies of link packets about anchors; wire.h describes their layout. After Parse every field
// is within bounds. Each body fits one Ethernet frame.

#include <cstdint>
#include <vector>

#include "link/wire.h"
#include "messages/anchor_messages.h"

namespace pangea {

// Bound for an encoded anchor_edit_t or anchor_t with the longest allowed name and payload.
inline constexpr int kMaxAnchorBytes = 1400;
inline constexpr int kMaxAnchorNumberBytes = 9;
static_assert(kMaxAnchorBytes + kMaxAnchorNumberBytes < kFramePayloadBytes);
inline constexpr size_t kMaxAnchorsReceived = 128;
inline constexpr size_t kMaxAnchorEditAnswers = 60;
// Largest rate of edits up, and of anchors down, per agent: bytes per second on the wire, with
// repeats.
inline constexpr double kAnchorBytesPerSecond = 4000;

// The state of an anchor, with a number that counts the states sent to this agent.
struct LinkAnchor {
  int64_t number = 0;  // from 1; of two states of an anchor, the one with the higher number counts
  AnchorState state;
};

// The server's answer to an edit.
struct AnchorEditAnswer {
  AnchorId anchor;
  int64_t revision = 0;
  bool journalled = false;  // false: the edit was refused and must not be sent again
};

std::vector<uint8_t> EncodeAnchorEdit(const AnchorEdit& edit);
// `message`: an encoded anchor_t.
std::vector<uint8_t> EncodeAnchor(int64_t number, Bytes message);
std::vector<uint8_t> EncodeAnchorsReceived(const std::vector<int64_t>& numbers);
std::vector<uint8_t> EncodeAnchorEditAnswers(const std::vector<AnchorEditAnswer>& answers);

// `agent_id`: the agent of the link. The edit, or the anchor's map, must be this agent's.
Parsed<AnchorEdit> ParseAnchorEdit(int32_t agent_id, Bytes body);
Parsed<LinkAnchor> ParseAnchor(int32_t agent_id, Bytes body);
Parsed<std::vector<int64_t>> ParseAnchorsReceived(Bytes body);
Parsed<std::vector<AnchorEditAnswer>> ParseAnchorEditAnswers(Bytes body);

}  // namespace pangea

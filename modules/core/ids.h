#pragma once

// Identities: agents are stable across runs, an agent opens one or more maps, a keyframe is (map,
// seq).

#include <compare>
#include <cstdint>
#include <string>

namespace pangea {

struct MapId {
  int32_t agent_id = 0;      // 1 .. 65535
  int64_t opened_utime = 0;  // wall clock at the opening, microseconds
  auto operator<=>(const MapId&) const = default;
};

struct KeyframeId {
  MapId map;
  int32_t seq = 0;  // from 0 without gaps in each map
  auto operator<=>(const KeyframeId&) const = default;
};

// Keyframes of a map that follow each other.
struct SeqGap {
  MapId map;
  int32_t from_seq = 0;
  int32_t to_seq = 0;  // inclusive
};

// "2/1700000000000000" and "2/1700000000000000#17": for people, logs and file names (with '/' as
// '_').
std::string ToString(const MapId& id);
std::string ToString(const KeyframeId& id);

// A 64-bit mix of ids that is the same in every run: seeds and constraint ids come from it.
uint64_t StableHash(const KeyframeId& a, const KeyframeId& b, uint64_t salt);

}  // namespace pangea

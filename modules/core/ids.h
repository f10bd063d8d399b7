#pragma once

// Identities. An agent keeps its id across runs. An agent opens one or more maps. A keyframe is
// identified by (map, seq).

#include <compare>
#include <cstdint>
#include <string>

namespace pangea {

struct MapId {
  int32_t agent_id = 0;      // 1 .. 65535
  int64_t opened_utime = 0;  // wall clock when the map was opened, microseconds
  auto operator<=>(const MapId&) const = default;
};

struct KeyframeId {
  MapId map;
  int32_t seq = 0;  // counts from 0 in each map, without gaps
  auto operator<=>(const KeyframeId&) const = default;
};

// Consecutive keyframes of one map, for example those that are missing.
struct SeqGap {
  MapId map;
  int32_t from_seq = 0;
  int32_t to_seq = 0;  // inclusive
};

// "2/1700000000000000" and "2/1700000000000000#17", for people and logs, and for file names, where
// '_' replaces '/'.
std::string ToString(const MapId& id);
std::string ToString(const KeyframeId& id);

// A 64-bit hash of two ids that is the same in every run. Random seeds and constraint ids use it.
uint64_t StableHash(const KeyframeId& a, const KeyframeId& b, uint64_t salt);

}  // namespace pangea

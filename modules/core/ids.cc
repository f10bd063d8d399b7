#include "core/ids.h"

#include <fmt/format.h>

#include <initializer_list>

namespace pangea {

std::string ToString(const MapId& id) { return fmt::format("{}/{}", id.agent_id, id.opened_utime); }

std::string ToString(const KeyframeId& id) {
  return fmt::format("{}#{}", ToString(id.map), id.seq);
}

uint64_t StableHash(const KeyframeId& a, const KeyframeId& b, uint64_t salt) {
  uint64_t hash = 0x9E3779B97F4A7C15ull;
  for (const uint64_t word :
       {static_cast<uint64_t>(a.map.agent_id), static_cast<uint64_t>(a.map.opened_utime),
        static_cast<uint64_t>(a.seq), static_cast<uint64_t>(b.map.agent_id),
        static_cast<uint64_t>(b.map.opened_utime), static_cast<uint64_t>(b.seq), salt}) {
    // splitmix64's finaliser (Steele et al., 2014)
    hash += word + 0x9E3779B97F4A7C15ull;
    hash = (hash ^ (hash >> 30)) * 0xBF58476D1CE4E5B9ull;
    hash = (hash ^ (hash >> 27)) * 0x94D049BB133111EBull;
    hash ^= hash >> 31;
  }
  return hash;
}

}  // namespace pangea

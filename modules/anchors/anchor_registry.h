#pragma once

// Merges all edits into the state of each anchor; the result does not depend on their order.
//
// Name and payload come from the edit with the highest (revision, agent); the place from the
// highest edit whose placement is possible. A deletion is final. An edit that the editor's key does
// not allow is refused and changes nothing.

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "core/anchor.h"

namespace pangea {

struct AnchorEntry {
  int64_t revision = 0;  // of the newest edit
  int32_t edited_by = 0;
  bool deleted = false;
  std::string name;
  std::string payload;
  // The edits with a placement that may count, by (revision, agent): the newest, and behind edits
  // on a surface, which the map may not have there, also the next older one.
  std::map<std::pair<int64_t, int32_t>, AnchorEdit> places;
};

class AnchorRegistry {
 public:
  explicit AnchorRegistry(size_t max_anchors) : max_anchors_(max_anchors) {}

  // Returns the reason of a refusal, or an empty string.
  std::string Take(const AnchorEdit& edit);

  const std::map<AnchorId, AnchorEntry>& entries() const { return entries_; }
  size_t num_deleted() const { return num_deleted_; }

 private:
  const size_t max_anchors_;  // not counting deleted ones
  std::map<AnchorId, AnchorEntry> entries_;
  size_t num_deleted_ = 0;
};

}  // namespace pangea

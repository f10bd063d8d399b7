#pragma once

// What all edits together say of each anchor, whatever the order they came in.
//
// Of what an anchor is called and holds, the edit with the highest (revision, agent) counts; of
// where it is, the highest of those that place it; one deletion, and it is deleted for ever. An
// edit that its editor's key does not allow is refused and changes nothing.

#include <cstdint>
#include <map>
#include <optional>
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
  std::optional<AnchorEdit> place;  // the newest that says where it is
};

class AnchorRegistry {
 public:
  explicit AnchorRegistry(size_t max_anchors) : max_anchors_(max_anchors) {}

  // Why it is refused, or an empty string.
  std::string Take(const AnchorEdit& edit);

  const std::map<AnchorId, AnchorEntry>& entries() const { return entries_; }
  size_t num_deleted() const { return num_deleted_; }

 private:
  const size_t max_anchors_;  // that are not deleted
  std::map<AnchorId, AnchorEntry> entries_;
  size_t num_deleted_ = 0;
};

}  // namespace pangea

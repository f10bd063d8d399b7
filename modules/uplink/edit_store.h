#pragma once

// Where an agent keeps its edits of anchors until the server has answered them: a disk
// (edit_spool.h), or a browser's storage (phone/agent/stored_edits.h). The caller bounds the number
// of edits.

#include <cstdint>
#include <vector>

#include "core/anchor.h"

namespace pangea {

class EditStore {
 public:
  virtual ~EditStore() = default;

  // The edits of an earlier run. Called once, at the start.
  virtual std::vector<AnchorEdit> TakeLeft() { return {}; }
  // Keeps the edit in place of an older one of the anchor.
  virtual void Put(const AnchorEdit& edit) = 0;
  // The server has answered this revision: removes the anchor's edit unless it is newer.
  virtual void Remove(const AnchorId& anchor, int64_t revision) = 0;
  // Makes what was put survive a power cut.
  virtual void Sync() {}
  // Whether the last Put could not be written.
  virtual bool refuses() const { return false; }
};

}  // namespace pangea

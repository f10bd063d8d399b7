#pragma once

// The agent's edits of anchors that the journal does not have yet, on disk beside the keyframes
// (spool.h): an uplink that is killed loses none.
//
// A file for each anchor: an ordinary LCM log of its newest ANCHOR_REQUEST_k, and the checksum of
// that. It appears whole, in place of the one before, and goes when the server has answered. What
// the page cache has survives the process; Sync makes it survive a power cut. A damaged file is
// said, and kept under another name. Bounded by whoever puts edits in. One thread.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/anchor.h"

namespace pangea {

class EditSpool {
 public:
  // `folder`: the spool's, which is there, and whose lock we have.
  EditSpool(std::filesystem::path folder, int32_t agent_id);

  // What an earlier run left: once, by anchor.
  std::vector<AnchorEdit> TakeLeft();
  // In place of what is kept of the anchor.
  void Put(const AnchorEdit& edit);
  // The server has answered this revision: what is kept of the anchor goes, unless it is newer.
  void Remove(const AnchorId& anchor, int64_t revision);
  void Sync();

  // The disk refused the last one.
  bool refuses() const { return refuses_; }

 private:
  std::filesystem::path File(const AnchorId& anchor) const;
  bool Write(const AnchorEdit& edit) const;
  std::optional<AnchorEdit> Read(const std::filesystem::path& file) const;

  const std::filesystem::path folder_;
  const std::string channel_;
  std::map<AnchorId, int64_t> revisions_;  // of those that are kept
  std::set<AnchorId> unsynced_;
  bool refuses_ = false;
};

}  // namespace pangea

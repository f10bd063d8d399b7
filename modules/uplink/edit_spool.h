#pragma once

// Keeps the agent's edits of anchors on disk, beside the keyframes (spool.h), until the server has
// answered them; so an uplink that is killed loses none.
//
// There is one file for each anchor: an ordinary LCM log with its newest ANCHOR_REQUEST_k and the
// checksum of that. A new file replaces the old one atomically, and is removed when the server has
// answered. The page cache survives the death of the process. Put writes the file to the disk; Sync
// makes its name survive a power cut. A damaged file is reported on stderr and renamed. Not
// thread safe.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "uplink/edit_store.h"

namespace pangea {

class EditSpool : public EditStore {
 public:
  // `folder`: the folder of the Spool, which exists and which this process has locked.
  EditSpool(std::filesystem::path folder, int32_t agent_id);

  // In the order of their anchors. Throws std::runtime_error if there is one of another agent.
  std::vector<AnchorEdit> TakeLeft() override;
  void Put(const AnchorEdit& edit) override;
  void Remove(const AnchorId& anchor, int64_t revision) override;
  void Sync() override;
  bool refuses() const override { return refuses_; }

 private:
  std::filesystem::path File(const AnchorId& anchor) const;
  bool Write(const AnchorEdit& edit) const;
  std::optional<AnchorEdit> Read(const std::filesystem::path& file) const;

  const std::filesystem::path folder_;
  const std::string channel_;
  std::map<AnchorId, int64_t> revisions_;  // of the edits that are kept
  bool folder_unsynced_ = false;           // a file was renamed since the last Sync
  bool refuses_ = false;
};

}  // namespace pangea

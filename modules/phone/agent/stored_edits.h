#pragma once

// The agent's edits of anchors in the storage of its owner, beside the keyframes: each change is
// handed out, and the owner gives back what is left at the next start (PhoneAgent::Restore).

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "uplink/edit_store.h"

namespace pangea::phone {

// A keyframe or an edit that the owner must store until the server has it, or may now delete.
struct SpoolChange {
  std::string id;
  std::vector<uint8_t> bytes;  // empty: delete
};

class StoredEdits : public EditStore {
 public:
  // Appends to `changes`, which must live longer.
  explicit StoredEdits(std::vector<SpoolChange>* changes) : changes_(changes) {}

  void Put(const AnchorEdit& edit) override;
  void Remove(const AnchorId& anchor, int64_t revision) override;

 private:
  std::vector<SpoolChange>* const changes_;
  std::map<AnchorId, int64_t> revisions_;  // of the edits that are stored
};

}  // namespace pangea::phone

#include "phone/agent/stored_edits.h"

#include "messages/anchor_messages.h"
#include "messages/encoding.h"

namespace pangea::phone {
namespace {

std::string EntryOf(const AnchorId& anchor) { return "anchor " + ToString(anchor); }

}  // namespace

void StoredEdits::Put(const AnchorEdit& edit) {
  revisions_[edit.anchor] = edit.revision;
  changes_->push_back({EntryOf(edit.anchor), EncodeMessage(ToMessage(edit))});
}

void StoredEdits::Remove(const AnchorId& anchor, int64_t revision) {
  const auto stored = revisions_.find(anchor);
  if (stored != revisions_.end() && stored->second <= revision) {
    changes_->push_back({EntryOf(anchor), {}});
    revisions_.erase(stored);
  }
}

}  // namespace pangea::phone

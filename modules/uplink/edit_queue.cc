#include "uplink/edit_queue.h"

#include <utility>

namespace pangea {
namespace {

void TakePlace(const AnchorEdit& older, AnchorEdit* newer) {
  newer->placement = older.placement;
  newer->map = older.map;
  newer->keyframe_seq = older.keyframe_seq;
  newer->utime = older.utime;
  newer->T_ref_anchor = older.T_ref_anchor;
  newer->pixel = older.pixel;
  newer->T_odom_body = older.T_odom_body;
  newer->covariance = older.covariance;
}

}  // namespace

EditQueue::Taken EditQueue::Add(AnchorEdit edit) {
  const auto older = edits_.find(edit.anchor);
  if (older != edits_.end()) {
    // A deletion is final, and must reach the server.
    if (edit.revision <= older->second.revision || older->second.deleted) {
      return Taken::kOutdated;
    }
    if (edit.placement == AnchorEdit::Placement::kSame) {
      TakePlace(older->second, &edit);
    }
  } else if (edits_.size() >= kMaxEdits) {
    return Taken::kFull;
  }
  queue_.Add(edit.anchor);
  edits_[edit.anchor] = std::move(edit);
  return Taken::kNew;
}

bool EditQueue::Has(const AnchorId& anchor, int64_t revision) const {
  const auto waiting = edits_.find(anchor);
  return waiting != edits_.end() && waiting->second.revision >= revision;
}

bool EditQueue::OnAnswer(const AnchorEditAnswer& answer) {
  const auto waiting = edits_.find(answer.anchor);
  if (waiting == edits_.end() || waiting->second.revision != answer.revision) {
    return false;
  }
  queue_.Remove(answer.anchor);
  edits_.erase(waiting);
  return true;
}

std::optional<AnchorEdit> EditQueue::Next(int64_t now_us) {
  const auto id = queue_.Next(now_us);
  return id ? std::optional(edits_.at(*id)) : std::nullopt;
}

}  // namespace pangea

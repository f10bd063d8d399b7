#include "uplink/uplink_anchors.h"

#include <utility>

#include "messages/anchor_messages.h"
#include "messages/channels.h"

namespace pangea {
namespace {

// Keyframes leave the odometry's window within seconds; a stationary agent makes one every five
// seconds.
constexpr int64_t kMaxHeld_us = 10'000'000;

}  // namespace

UplinkAnchors::UplinkAnchors(Node& node, int32_t agent_id, double edit_bytes_per_s,
                             EditStore* spool)
    : node_(node), agent_id_(agent_id), spool_(spool), edits_(edit_bytes_per_s) {
  if (spool_ != nullptr) {
    for (AnchorEdit& edit : spool_->TakeLeft()) {
      Queue(std::move(edit));
    }
  }
  node_.Listen<anchor_edit_t>(channels::AnchorRequest(agent_id),
                              [this](AnchorEdit edit) { OnRequest(std::move(edit)); });
}

void UplinkAnchors::OnPose(int64_t utime, const MapId& map,
                           const std::optional<Rigid3>& T_odom_body) {
  shown_.OnPose(utime, map);
  if (T_odom_body) {
    poses_.AddPose(utime, map, *T_odom_body);
  }
}

void UplinkAnchors::OnKeyframe(int64_t utime, const MapId& map, const Rigid3& T_odom_body) {
  shown_.OnKeyframe(utime, map);
  poses_.AddKeyframe(utime, map, T_odom_body);
  ReleaseSettled();
}

void UplinkAnchors::OnRequest(AnchorEdit edit) {
  if (edit.agent_id != 0 && edit.agent_id != agent_id_) {
    return node_.Refuse("another agent's edit of an anchor");
  }
  if (const std::string refusal = RefusalOfNewEdit(edit); !refusal.empty()) {
    return node_.Refuse(refusal);
  }
  edit.agent_id = agent_id_;
  edit.right = AnchorRight::kUnknown;
  edit.seq = -1;
  const bool by_pose = edit.placement == AnchorEdit::Placement::kBody ||
                       edit.placement == AnchorEdit::Placement::kPixel;
  const auto held = held_.find(edit.anchor);
  if (held != held_.end() && held->second.edit.revision >= edit.revision) {
    return node_.Count("anchor_edits_repeated");
  }
  Release(edit.anchor);  // the queue merges the two edits
  if (by_pose && !edit.T_odom_body && held_.size() < EditQueue::kMaxEdits &&
      !edits_.Has(edit.anchor, edit.revision)) {
    return Hold(std::move(edit));
  }
  Queue(std::move(edit));
}

// If the process is killed meanwhile, the next run sends the edit with the pose known by now.
void UplinkAnchors::Hold(AnchorEdit edit) {
  if (spool_ != nullptr) {
    AnchorEdit by_now = edit;
    by_now.T_odom_body = poses_.At(edit.utime, edit.map);
    spool_->Put(by_now);
  }
  const AnchorId id = edit.anchor;
  held_[id] = {std::move(edit), now_us_ + kMaxHeld_us};
  ReleaseSettled();
}

void UplinkAnchors::Release(const AnchorId& id) {
  if (auto held = held_.extract(id)) {
    AnchorEdit& edit = held.mapped().edit;
    edit.T_odom_body = poses_.At(edit.utime, edit.map);
    Queue(std::move(edit));
  }
}

void UplinkAnchors::ReleaseSettled() {
  std::vector<AnchorId> settled;
  for (const auto& [id, held] : held_) {
    if (poses_.IsSettled(held.edit.utime, held.edit.map) || now_us_ >= held.until_us) {
      settled.push_back(id);
    }
  }
  for (const AnchorId& id : settled) {
    Release(id);
  }
}

void UplinkAnchors::Queue(AnchorEdit edit) {
  const AnchorId id = edit.anchor;
  const int64_t revision = edit.revision;
  switch (edits_.Add(std::move(edit))) {
    case EditQueue::Taken::kNew:
      if (spool_ != nullptr) {
        spool_->Put(edits_.Waiting(id));  // the merged edit: it may have the older one's placement
      }
      return node_.Count("anchor_edits");
    case EditQueue::Taken::kOutdated:
      return node_.Count("anchor_edits_repeated");
    case EditQueue::Taken::kFull:
      if (spool_ != nullptr) {
        spool_->Remove(id, revision);
      }
      node_.NoteDropped();
      return node_.Refuse("too many edits of anchors wait for the server");
  }
}

void UplinkAnchors::OnNewSession() {
  edits_.OnNewSession();
  anchors_.OnNewSession();
}

void UplinkAnchors::OnPacket(const LinkPacket& packet, int64_t now_us) {
  if (packet.kind == LinkKind::kAnchor) {
    OnAnchor(packet.body, now_us);
  } else {
    OnEditAnswers(packet.body);
  }
}

void UplinkAnchors::Tell(const AnchorState& state) {
  node_.Publish(channels::Anchor(agent_id_), ToMessage(state));
}

void UplinkAnchors::OnAnchor(Bytes body, int64_t now_us) {
  const auto anchor = ParseAnchor(agent_id_, body);
  if (!anchor.value) {
    return node_.Refuse(anchor.refused);
  }
  if (auto left_out = anchors_.MakeRoomFor(anchor.value->state)) {
    left_out->gone = true;
    Tell(*left_out);
    shown_.Erase(left_out->anchor);
  }
  switch (anchors_.Take(*anchor.value, now_us)) {
    case AgentAnchors::Taken::kNew:
      node_.Set("anchors", static_cast<int64_t>(anchors_.size()));
      Tell(anchor.value->state);
      return shown_.Set(anchor.value->state);
    case AgentAnchors::Taken::kKnown:
      return;
    case AgentAnchors::Taken::kFull:
      return node_.Refuse("more anchors than an agent keeps");
  }
}

void UplinkAnchors::OnEditAnswers(Bytes body) {
  const auto answers = ParseAnchorEditAnswers(body);
  if (!answers.value) {
    return node_.Refuse(answers.refused);
  }
  for (const AnchorEditAnswer& answer : *answers.value) {
    if (!edits_.OnAnswer(answer)) {
      continue;  // a repeat
    }
    if (spool_ != nullptr) {
      spool_->Remove(answer.anchor, answer.revision);
    }
    node_.Count(answer.journalled ? "anchor_edits_journalled" : "anchor_edits_refused");
    if (!answer.journalled) {
      node_.Refuse("the server refused an edit of an anchor: what our key there allows");
    }
  }
}

void UplinkAnchors::SendDue(int64_t now_us, const Send& send) {
  while (const auto edit = edits_.Next(now_us)) {
    edits_.Charge(send(LinkKind::kAnchorEdit, EncodeAnchorEdit(*edit)));
  }
  if (const std::vector<int64_t> received = anchors_.TakeReceived(); !received.empty()) {
    send(LinkKind::kAnchorsReceived, EncodeAnchorsReceived(received));
  }
}

void UplinkAnchors::Publish(int64_t now_us) {
  now_us_ = now_us;
  ReleaseSettled();
  for (const AnchorState& state : anchors_.DueAgain(now_us)) {
    Tell(state);
  }
  if (const auto shown = shown_.Poll(now_us)) {
    node_.Publish(channels::ShownAnchors(agent_id_), ToMessage(*shown));
  }
}

}  // namespace pangea

#include "viewer/viewer_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <string_view>
#include <utility>

#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/messages.h"

namespace pangea::viewer {
namespace {

// Keyframes beyond this number would not be shown anyway.
constexpr auto kMaxSeqAsked = static_cast<int32_t>(Scene::kMaxKeyframes);

}  // namespace

ViewerProcess::ViewerProcess(Bus& bus, std::string source, int64_t start_utime, Pages pages)
    : node_(bus, "viewer"),
      source_(std::move(source)),
      start_utime_(start_utime),
      pages_(pages),
      now_utime_(start_utime) {
  for (const std::string_view channel :
       {channels::kAllKeyframes, channels::kAllPoses, channels::kAllCorrections,
        channels::kConstraint, channels::kMapState, channels::kAllStatus, channels::kAllImages,
        channels::kAnchor}) {
    node_.SubscribeBytes(std::string(channel), std::bind_front(&ViewerProcess::OnMessage, this));
  }
  node_.SubscribeBytes(channels::Again(node_.name()),
                       std::bind_front(&ViewerProcess::OnMessage, this));
  node_.Listen<anchor_edit_t>(channels::kAnchorEdit,
                              std::bind_front(&ViewerProcess::OnAnchorEdit, this));
  node_.Listen<have_t>(channels::kHave, std::bind_front(&ViewerProcess::OnHave, this));
}

void ViewerProcess::WatchAgent(Bus& agent_bus) {
  agent_bus.Subscribe(std::string(channels::kAllImages),
                      std::bind_front(&ViewerProcess::OnMessage, this));
}

void ViewerProcess::OnMessage(const std::string& channel, Bytes data) {
  SceneEvents::Outcome outcome = events_.Parse(channel, data);
  if (!outcome.refused.empty()) {
    node_.Refuse(outcome.refused);
  }
  if (!outcome.event) {
    return;
  }
  if (const auto* keyframe = std::get_if<ShownKeyframe>(&*outcome.event)) {
    keyframes_.Note(keyframe->id.map, keyframe->id.seq);
  }
  if (const auto* anchor = std::get_if<AnchorState>(&*outcome.event)) {
    requests_.Shown(anchor->anchor, anchor->revision);
  }
  NoteForAnchors(&outcome);
  std::visit([this](const auto& event) { scene_.Take(event); }, *outcome.event);
}

void ViewerProcess::NoteForAnchors(SceneEvents::Outcome* outcome) {
  if (!editable()) {
    return;
  }
  if (const auto* state = std::get_if<MapState>(&*outcome->event)) {
    anchors_.Take(*state);
  }
  if (outcome->keyframe && scene_.keyframes().size() < Scene::kMaxKeyframes) {
    outcome->keyframe->points.clear();  // only needed for anchors behind pixels
    anchors_.Take(*outcome->keyframe);
  }
}

void ViewerProcess::OnHave(const Have& have) {
  for (const auto& [map, highest_seq] : have.highest_seq) {
    if (results_requested_.size() < Scene::kMaxMaps && results_requested_.insert(map).second) {
      RequestAllRetransmissions(node_, std::string(channels::kConstraint), map,
                                std::min(highest_seq, kMaxSeqAsked));
    }
  }
  keyframes_.Announce(have);
}

void ViewerProcess::AskForMissing(int64_t now_utime) {
  for (const SeqGap& gap : keyframes_.Due(now_utime)) {
    RequestRetransmission(node_, channels::Keyframe(gap.map.agent_id), gap);
  }
}

void ViewerProcess::OnAnchorEdit(const AnchorEdit& edit) {
  if (const auto lost = requests_.TakeLost(edit)) {
    scene_.Tell(fmt::format("\"{}\" was not changed: another edit came first", lost->name));
  }
}

int64_t ViewerProcess::NewAnchorUtime() {
  newest_anchor_utime_ = std::max(now_utime_, newest_anchor_utime_ + 1);
  return newest_anchor_utime_;
}

void ViewerProcess::Change(const AnchorChange& change) {
  auto edit = EditOf(scene_, change, NewAnchorUtime());
  if (edit) {
    anchors_.MakeExact(&*edit);
  }
  if (!edit) {
    scene_.Tell("nothing was changed: that anchor is no longer there");
  } else if (!requests_.Add(*edit, now_utime_)) {
    scene_.Tell("nothing was changed: too many edits wait for the server");
  }
}

void ViewerProcess::PublishRequests() {
  for (const AnchorEdit& edit : requests_.TakeGivenUp(now_utime_)) {
    node_.Refuse("anchor edit: not in the journal after 20 s");
    scene_.Tell(fmt::format("\"{}\": the server did not confirm the change", edit.name));
  }
  for (const AnchorEdit& edit : requests_.Due(now_utime_)) {
    node_.Publish(channels::AnchorRequest(0), ToMessage(edit));
  }
}

void ViewerProcess::Tick(int64_t now_utime) {
  now_utime_ = now_utime;
  clock_.now_s = 1e-6 * static_cast<double>(now_utime - start_utime_);
  scene_.SetTime(clock_.now_s);
  AskForMissing(now_utime);
  PublishRequests();
  if (node_.StatusIsDue(now_utime)) {
    node_.Set("keyframes", static_cast<int64_t>(scene_.keyframes().size()));
    node_.Set("left_out", scene_.num_left_out());
    node_.PublishStatus(now_utime, 0,
                        fmt::format("{} agents, {} keyframes, {} verification results shown",
                                    scene_.agents().size(), scene_.keyframes().size(),
                                    scene_.constraints().size()));
  }
}

}  // namespace pangea::viewer

#include "anchors/anchors_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <string>
#include <utility>

#include "bus/record_status.h"
#include "bus/retransmission/missing.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"

namespace pangea {
namespace {

constexpr int64_t kSecond_us = 1'000'000;
constexpr int64_t kPublishInterval_us = 250'000;
constexpr int64_t kOthersInterval_us = 200'000;
// A stationary agent makes a keyframe every five seconds.
constexpr int64_t kEndedInterval_us = 10 * kSecond_us;
constexpr int32_t kMaxAsked = 50;
// agent_handler repeats the newest edit every second, so after this time any gap is known.
constexpr int64_t kNewestEditRepeated_us = 2 * kSecond_us;
// Edits are a single stream for all maps; this is its key in ReorderBuffer.
const MapId kAllMaps{1, 0};

}  // namespace

AnchorsProcess::AnchorsProcess(Bus& bus, const AnchorsOptions& options,
                               std::shared_ptr<RecordStore> records)
    : node_(bus, "anchors"),
      anchors_(options, std::move(records)),
      journal_(node_, {.in_order = true, .gives_up = true, .states = true},
               {.keyframe = [this](const Keyframe& keyframe) { anchors_.Take(keyframe); },
                .have = [this](const Have&) { have_received_ = true; },
                .anchor_edit = std::bind_front(&AnchorsProcess::OnEdit, this)}) {
  node_.Listen<map_state_t>(channels::kMapState,
                            std::bind_front(&AnchorsProcess::OnMapState, this));
  node_.Listen<correction_t>(channels::kAllCorrections,
                             [this](const Correction& correction) { anchors_.Take(correction); });
  node_.Subscribe<pose_t>(std::string(channels::kAllPoses),
                          [this](const std::string&, const pose_t& message) { OnPose(message); });
}

void AnchorsProcess::OnPose(const pose_t& message) {
  const auto map = Parse(message.map);
  const auto T_odom_body = Parse(message.T_odom_body);
  if (message.state != pose_t::STATE_TRACKING) {
    return;
  }
  if (!map.value || !T_odom_body.value) {
    return node_.Refuse("pose: invalid map or pose");
  }
  anchors_.SetCurrentMap(*map.value);
  other_agents_.Take(*map.value, *T_odom_body.value, now_utime_);
}

void AnchorsProcess::OnMapState(MapState state, const map_state_t& message) {
  if (const auto whole = states_.Add(message.chunk, message.num_chunks, std::move(state))) {
    anchors_.Take(*whole);
    journal_.NoteStates(whole->maps);
  }
}

void AnchorsProcess::OnEdit(AnchorEdit edit) {
  if (edit.seq < 0 || edit.seq > std::numeric_limits<int32_t>::max() - 1) {
    return node_.Refuse("anchor edit: not from the journal");
  }
  const auto seq = static_cast<int32_t>(edit.seq);
  for (const AnchorEdit& next : edits_.Add(kAllMaps, seq, std::move(edit))) {
    const std::string refused = anchors_.Take(next);
    if (!refused.empty()) {
      node_.Refuse(refused);
    }
    if (on_edit_taken_) {
      on_edit_taken_(next, refused);
    }
  }
}

void AnchorsProcess::Request(const AnchorEdit& edit) {
  node_.Publish(channels::AnchorRequest(edit.agent_id), ToMessage(edit));
}

bool AnchorsProcess::is_complete() const {
  return have_utime_ > 0 && now_utime_ >= have_utime_ + kNewestEditRepeated_us &&
         !journal_.catching_up() && edits_.Gaps().empty();
}

void AnchorsProcess::RequestMissingEdits(int64_t now_utime) {
  if (now_utime < next_request_utime_) {
    return;
  }
  next_request_utime_ = now_utime + kSecond_us;
  for (SeqGap gap : edits_.Gaps()) {
    gap.to_seq = std::min(gap.to_seq, gap.from_seq + kMaxAsked - 1);
    RequestRetransmission(node_, std::string(channels::kAnchorEdit), gap);
  }
}

void AnchorsProcess::PublishDue(int64_t now_utime) {
  if (now_utime < next_publish_utime_ || journal_.catching_up()) {
    return;
  }
  next_publish_utime_ = now_utime + kPublishInterval_us;
  std::map<MapId, AnchorUpdates> for_agents;
  for (const MapId& map : anchors_.AgentMaps()) {
    auto known = for_agents_.extract(map);
    AnchorUpdates& updates =
        known ? for_agents.insert(std::move(known)).position->second : for_agents[map];
    for (const AnchorState& state :
         updates.Due(anchors_.ForAgent(map, updates.Told()), now_utime)) {
      node_.Publish(channels::Anchor(map.agent_id), ToMessage(state));
    }
  }
  for_agents_ = std::move(for_agents);
  for (const AnchorState& state : for_watchers_.Due(anchors_.All(), now_utime)) {
    node_.Publish(std::string(channels::kAnchor), ToMessage(state));
  }
}

void AnchorsProcess::PublishOthers(int64_t now_utime) {
  if (now_utime < next_others_utime_) {
    return;
  }
  next_others_utime_ = now_utime + kOthersInterval_us;
  for (const Others& others : other_agents_.ForEach(anchors_, now_utime)) {
    node_.Publish(channels::Others(others.map.agent_id), ToMessage(others));
  }
}

// What still waits when the journal was received has waited before the restart already.
void AnchorsProcess::PlaceInEndedMaps(int64_t now_utime) {
  const bool has_restarted = !was_complete_ && is_complete();
  was_complete_ |= has_restarted;
  if (journal_.catching_up() || (now_utime < next_ended_utime_ && !has_restarted)) {
    return;
  }
  next_ended_utime_ = now_utime + kEndedInterval_us;
  for (int i = 0; i < (has_restarted ? 2 : 1); ++i) {
    anchors_.PlaceInEndedMaps();
  }
}

void AnchorsProcess::Finish() {
  for (int i = 0; i < 2; ++i) {  // no keyframe comes in between
    anchors_.PlaceInEndedMaps();
  }
  for (const AnchorState& state : anchors_.All()) {
    node_.Publish(std::string(channels::kAnchor), ToMessage(state));
  }
}

void AnchorsProcess::Tick(int64_t now_utime) {
  now_utime_ = now_utime;
  have_utime_ = have_received_ && have_utime_ == 0 ? now_utime : have_utime_;
  journal_.Tick(now_utime);
  RequestMissingEdits(now_utime);
  PlaceInEndedMaps(now_utime);
  PublishDue(now_utime);
  PublishOthers(now_utime);
  if (node_.StatusIsDue(now_utime)) {
    PublishStatus(now_utime);
  }
}

void AnchorsProcess::PublishStatus(int64_t now_utime) {
  // Includes anchors that were waiting for a keyframe.
  for (const std::string& reason : anchors_.TakeNotPlaced()) {
    node_.Refuse(reason);
  }
  node_.Set("anchors", static_cast<int64_t>(anchors_.num_anchors()));
  node_.Set("anchors_placed", static_cast<int64_t>(anchors_.num_placed()));
  const std::string note = NoteRecords(anchors_.store_counters(), anchors_.records(), &node_);
  node_.PublishStatus(now_utime, static_cast<int64_t>(anchors_.num_waiting()),
                      fmt::format("{} anchors, {} of them placed{}", anchors_.num_anchors(),
                                  anchors_.num_placed(), note));
}

}  // namespace pangea

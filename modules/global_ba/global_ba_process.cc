#include "global_ba/global_ba_process.h"

#include <fmt/format.h>

#include <functional>
#include <utility>

#include "messages/catch_up_messages.h"
#include "messages/channels.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr int64_t kSecond = 1'000'000;
// Longer than the pose graph waits before it solves all from the beginning.
constexpr int64_t kQuiet_us = 3 * kSecond;

}  // namespace

GlobalBaProcess::GlobalBaProcess(Bus& bus, const GlobalBaOptions& options)
    : node_(bus, "global_ba"), global_ba_(options) {
  node_.Listen<keyframe_t>(channels::kAllKeyframes,
                           std::bind_front(&GlobalBaProcess::OnKeyframe, this));
  node_.Listen<place_match_t>(channels::kPlaceMatch,
                              std::bind_front(&GlobalBaProcess::OnPlaceMatch, this));
  node_.Listen<constraint_t>(channels::kConstraint,
                             std::bind_front(&GlobalBaProcess::OnConstraint, this));
  node_.Listen<map_state_t>(channels::kMapState,
                            std::bind_front(&GlobalBaProcess::OnMapState, this));
  node_.Listen<have_t>(channels::kHave, std::bind_front(&GlobalBaProcess::OnHave, this));
  node_.Subscribe<again_t>(
      channels::Again(node_.name()),
      [this](const std::string&, const again_t& message) { OnRetransmission(message); });
}

void GlobalBaProcess::OnKeyframe(Keyframe keyframe) {
  ++num_inputs_;
  keyframes_.Note(keyframe.id.map, keyframe.id.seq);
  global_ba_.Take(std::move(keyframe));
}

void GlobalBaProcess::OnPlaceMatch(const PlaceMatch& match) {
  ++num_inputs_;
  matches_.Note(match.query.map, match.query.seq);
  global_ba_.Take(match);
}

void GlobalBaProcess::OnConstraint(const Constraint& constraint) {
  ++num_inputs_;
  global_ba_.Take(constraint);
}

void GlobalBaProcess::OnMapState(MapState state, const map_state_t& message) {
  if (auto whole = chunks_.Add(message.chunk, message.num_chunks, std::move(state))) {
    missing_states_.Note(whole->maps);
    global_ba_.Take(std::move(*whole));
  }
}

void GlobalBaProcess::OnHave(const Have& have) {
  for (const auto& [map, highest_seq] : have.highest_seq) {
    if (keyframes_.Lacks(map, 0)) {
      missing_states_.Announce(map);
    }
    // What was verified before this process started.
    if (results_requested_.insert(map).second) {
      RequestAllRetransmissions(node_, std::string(channels::kConstraint), map, highest_seq);
    }
  }
  keyframes_.Announce(have);
  matches_.Announce(have);
}

void GlobalBaProcess::OnRetransmission(const again_t& message) {
  const bool known = TakeRetransmission<keyframe_t>(
                         node_, message, std::bind_front(&GlobalBaProcess::OnKeyframe, this)) ||
                     TakeRetransmission<place_match_t>(
                         node_, message, std::bind_front(&GlobalBaProcess::OnPlaceMatch, this)) ||
                     TakeRetransmission<constraint_t>(
                         node_, message, std::bind_front(&GlobalBaProcess::OnConstraint, this));
  if (!known) {
    node_.Refuse("again: not what was asked for");
  }
}

void GlobalBaProcess::Advance() {
  if (const auto refined = global_ba_.Advance()) {
    for (const map_state_t& chunk : ToMessages(*refined)) {
      node_.Publish(std::string(channels::kRefinement), chunk);
    }
  }
}

void GlobalBaProcess::Finish() {
  while (global_ba_.HasWork()) {
    Advance();
  }
}

void GlobalBaProcess::Tick(int64_t now_utime) {
  for (const SeqGap& gap : keyframes_.Due(now_utime)) {
    RequestRetransmission(node_, channels::Keyframe(gap.map.agent_id), gap);
  }
  for (const SeqGap& gap : matches_.Due(now_utime)) {
    RequestRetransmission(node_, std::string(channels::kPlaceMatch), gap);
  }
  for (const MapId& map : missing_states_.Due(now_utime)) {
    AskForState(node_, map);
  }
  if (num_inputs_ != num_inputs_at_change_) {
    num_inputs_at_change_ = num_inputs_;
    last_input_utime_ = now_utime;
  }
  if (now_utime >= next_status_utime_) {
    next_status_utime_ = now_utime + kSecond;
    PublishStatus(now_utime);
  }
  if (now_utime >= last_input_utime_ + kQuiet_us && !node_.bus().MoreWaits() &&
      global_ba_.HasWork()) {
    Advance();
  }
}

void GlobalBaProcess::PublishStatus(int64_t now_utime) {
  const GlobalBa::Counters& counters = global_ba_.counters();
  node_.Set("adjustments_begun", counters.begun);
  node_.Set("adjustments_dropped", counters.dropped);
  node_.Set("adjustments_finished", counters.finished);
  node_.PublishStatus(now_utime, global_ba_.HasWork() ? 1 : 0,
                      fmt::format("{} keyframes, {} groups adjusted, {} adjustments dropped",
                                  global_ba_.num_keyframes(), counters.finished, counters.dropped));
}

}  // namespace pangea

#include "global_ba/global_ba_process.h"

#include <fmt/format.h>

#include <utility>

#include "common/catch_up_messages.h"
#include "common/channels.h"
#include "common/messages.h"

namespace pangea {
namespace {

constexpr int64_t kSecond = 1'000'000;
// Longer than the pose graph waits before it solves all from the beginning.
constexpr int64_t kQuiet_us = 3 * kSecond;
constexpr int32_t kMaxVerdictsAsked = 500;  // keyframes' verdicts

}  // namespace

GlobalBaProcess::GlobalBaProcess(Bus& bus, const GlobalBaOptions& options)
    : node_(bus, "global_ba"), global_ba_(options) {
  node_.Subscribe<keyframe_t>(
      std::string(channels::kAllKeyframes),
      [this](const std::string&, const keyframe_t& message) { OnKeyframe(message); });
  node_.Subscribe<place_match_t>(
      std::string(channels::kPlaceMatch),
      [this](const std::string&, const place_match_t& message) { OnPlaceMatch(message); });
  node_.Subscribe<constraint_t>(
      std::string(channels::kConstraint),
      [this](const std::string&, const constraint_t& message) { OnConstraint(message); });
  node_.Subscribe<map_state_t>(
      std::string(channels::kMapState),
      [this](const std::string&, const map_state_t& message) { OnMapState(message); });
  node_.Subscribe<have_t>(std::string(channels::kHave),
                          [this](const std::string&, const have_t& message) { OnHave(message); });
  node_.Subscribe<again_t>(
      channels::Again(node_.name()),
      [this](const std::string&, const again_t& message) { OnAgain(message); });
}

void GlobalBaProcess::OnKeyframe(const keyframe_t& message) {
  Parsed<Keyframe> parsed = Parse(message);
  if (!parsed.value) {
    node_.Refuse(parsed.refused);
    return;
  }
  ++num_news_;
  keyframes_.Note(parsed.value->id.map, parsed.value->id.seq);
  global_ba_.Take(std::move(*parsed.value));
}

void GlobalBaProcess::OnPlaceMatch(const place_match_t& message) {
  const Parsed<PlaceMatch> parsed = Parse(message);
  if (!parsed.value) {
    node_.Refuse(parsed.refused);
    return;
  }
  ++num_news_;
  matches_.Note(parsed.value->query.map, parsed.value->query.seq);
  global_ba_.Take(*parsed.value);
}

void GlobalBaProcess::OnConstraint(const constraint_t& message) {
  const Parsed<Constraint> parsed = Parse(message);
  if (!parsed.value) {
    node_.Refuse(parsed.refused);
    return;
  }
  ++num_news_;
  global_ba_.Take(*parsed.value);
}

void GlobalBaProcess::OnMapState(const map_state_t& message) {
  Parsed<MapState> parsed = Parse(message);
  if (!parsed.value) {
    node_.Refuse(parsed.refused);
    return;
  }
  if (auto whole = chunks_.Add(message.chunk, message.num_chunks, std::move(*parsed.value))) {
    missing_states_.Note(whole->maps);
    global_ba_.Take(std::move(*whole));
  }
}

void GlobalBaProcess::OnHave(const have_t& message) {
  const Parsed<Have> have = Parse(message);
  if (!have.value) {
    node_.Refuse(have.refused);
    return;
  }
  for (const auto& [map, highest_seq] : have.value->highest_seq) {
    if (keyframes_.Lacks(map, 0)) {
      missing_states_.Announce(map);
    }
    keyframes_.Announce(map, highest_seq);
    matches_.Announce(map, highest_seq);
    // What was judged before this process started.
    if (verdicts_asked_.insert(map).second) {
      for (int32_t seq = 0; seq <= highest_seq; seq += kMaxVerdictsAsked) {
        AskAgain(node_, std::string(channels::kConstraint),
                 {map, seq, seq + kMaxVerdictsAsked - 1});
      }
    }
  }
  for (const SeqGap& gap : have.value->gaps) {
    keyframes_.Skip(gap);
    matches_.Skip(gap);
  }
}

void GlobalBaProcess::OnAgain(const again_t& message) {
  const bool known =
      TakeAgain<keyframe_t>(message, [this](const keyframe_t& m) { OnKeyframe(m); }) ||
      TakeAgain<place_match_t>(message, [this](const place_match_t& m) { OnPlaceMatch(m); }) ||
      TakeAgain<constraint_t>(message, [this](const constraint_t& m) { OnConstraint(m); });
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
    AskAgain(node_, channels::Keyframe(gap.map.agent_id), gap);
  }
  for (const SeqGap& gap : matches_.Due(now_utime)) {
    AskAgain(node_, std::string(channels::kPlaceMatch), gap);
  }
  for (const MapId& map : missing_states_.Due(now_utime)) {
    AskForState(node_, map);
  }
  if (num_news_ != num_news_at_change_) {
    num_news_at_change_ = num_news_;
    last_news_utime_ = now_utime;
  }
  if (now_utime >= next_status_utime_) {
    next_status_utime_ = now_utime + kSecond;
    PublishStatus(now_utime);
  }
  if (now_utime >= last_news_utime_ + kQuiet_us && !node_.bus().MoreWaits() &&
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

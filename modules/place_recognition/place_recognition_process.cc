#include "place_recognition/place_recognition_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "messages/catch_up_messages.h"
#include "messages/channels.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr int64_t kRetransmissionTimeout_us = 500'000;
constexpr int64_t kStatusInterval_us = 1'000'000;
// At 28 kB a keyframe a request's answers fit the receive buffer.
constexpr int32_t kMaxKeyframesPerRequest = 50;
// Bounds: of matches kept to be retransmitted (then the oldest go), and of what waits in a catch-up
// or for its turn (then the first is worked off at once).
constexpr size_t kMaxSentPerMap = 2000;
constexpr size_t kMaxHeld = 2000;
constexpr size_t kMaxKnownMatches = 100'000;
// Nobody answers: what waits is worked off without the keyframes that are missing.
constexpr int kGiveUpKeyframesTicks = 50;

}  // namespace

PlaceRecognitionProcess::PlaceRecognitionProcess(Bus& bus, const PlaceRecognitionOptions& options)
    : node_(bus, "place_recognition"), recognition_(options) {
  node_.Listen<keyframe_t>(channels::kAllKeyframes,
                           std::bind_front(&PlaceRecognitionProcess::OnKeyframe, this));
  node_.Listen<map_state_t>(channels::kMapState,
                            std::bind_front(&PlaceRecognitionProcess::OnMapState, this));
  node_.Listen<have_t>(channels::kHave, std::bind_front(&PlaceRecognitionProcess::OnHave, this));
  node_.Subscribe<again_t>(
      channels::Again(node_.name()),
      [this](const std::string&, const again_t& message) { OnRetransmission(message); });
  node_.Listen<resend_request_t>(channels::kResendRequest,
                                 std::bind_front(&PlaceRecognitionProcess::OnResendRequest, this));
}

void PlaceRecognitionProcess::Tick(int64_t now_utime) {
  AskForGaps(now_utime);
  for (const MapId& map : missing_states_.Due(now_utime)) {
    AskForState(node_, map);
  }
  ++ticks_without_keyframe_;
  ReleaseHeldIfCaughtUp();
  if (now_utime >= next_status_utime_) {
    next_status_utime_ = now_utime + kStatusInterval_us;
    PublishStatus(now_utime);
  }
}

void PlaceRecognitionProcess::OnKeyframe(Keyframe keyframe) {
  const KeyframeId id = keyframe.id;
  const std::optional<OdometryEdge>& edge = keyframe.edge;
  if (edge && edge->from_seq < id.seq - 1) {
    // What lies between was lost for good, or the edge would begin at the keyframe before.
    HandleAll(keyframes_.Skip({id.map, edge->from_seq + 1, id.seq - 1}));
  }
  HandleAll(keyframes_.Add(id.map, id.seq, std::move(keyframe)));
}

void PlaceRecognitionProcess::HandleAll(const std::vector<Keyframe>& ready) {
  ticks_without_keyframe_ = 0;
  for (const Keyframe& keyframe : ready) {
    Handle(keyframe);
  }
  ReleaseHeldIfCaughtUp();
}

void PlaceRecognitionProcess::Handle(const Keyframe& keyframe) {
  if (const auto known = known_matches_.extract(keyframe.id)) {
    recognition_.Remember(keyframe, known.mapped());
    node_.Count("matches_of_the_journal");
  } else {
    held_.push_back(keyframe);
    if (!catching_up_) {
      RecogniseHeld();
    }
  }
}

void PlaceRecognitionProcess::RecogniseHeld() {
  while (held_.size() > kMaxHeld) {
    RecogniseNext();
  }
  if (!held_.empty()) {
    node_.WorkWhenIdle([this] { return RecogniseNext(); });
  }
}

bool PlaceRecognitionProcess::RecogniseNext() {
  if (held_.empty() || catching_up_) {
    return false;
  }
  Recognise(held_.front());
  held_.pop_front();
  return !held_.empty();
}

void PlaceRecognitionProcess::Recognise(const Keyframe& keyframe) {
  const place_match_t message = ToMessage(recognition_.Add(keyframe));
  node_.Publish(std::string(channels::kPlaceMatch), message);
  auto& sent = sent_[keyframe.id.map];
  sent[keyframe.id.seq] = message;
  if (sent.size() > kMaxSentPerMap) {
    sent.erase(sent.begin());
  }
}

void PlaceRecognitionProcess::ReleaseHeldIfCaughtUp() {
  const bool keyframes_in =
      keyframes_.Gaps().empty() || ticks_without_keyframe_ > kGiveUpKeyframesTicks;
  if (catching_up_ && ((keyframes_in && missing_states_.empty()) || held_.size() > kMaxHeld)) {
    ReleaseHeld();
  }
}

void PlaceRecognitionProcess::ReleaseHeld() {
  catching_up_ = false;
  known_matches_.clear();
  RecogniseHeld();
}

void PlaceRecognitionProcess::OnHave(const Have& have) {
  for (const auto& [map, highest_seq] : have.highest_seq) {
    // A map we know nothing of, yet the journal does: we are the one who came late.
    if (keyframes_.next(map) == 0) {
      catching_up_ = true;
      missing_states_.Announce(map);
    }
    keyframes_.Announce(map, highest_seq);
  }
  for (const SeqGap& gap : have.gaps) {
    HandleAll(keyframes_.Skip(gap));
  }
}

void PlaceRecognitionProcess::OnRetransmission(const again_t& message) {
  const bool known =
      TakeRetransmission<place_match_t>(
          node_, message, std::bind_front(&PlaceRecognitionProcess::OnKnownMatch, this)) ||
      TakeRetransmission<keyframe_t>(node_, message,
                                     std::bind_front(&PlaceRecognitionProcess::OnKeyframe, this));
  if (!known) {
    node_.Refuse("again: neither match nor keyframe");
  }
}

void PlaceRecognitionProcess::OnKnownMatch(PlaceMatch match) {
  const KeyframeId query = match.query;
  if (query.seq >= keyframes_.next(query.map) && known_matches_.size() < kMaxKnownMatches) {
    known_matches_.insert_or_assign(query, std::move(match));
  }
}

void PlaceRecognitionProcess::OnMapState(const MapState& state) {
  missing_states_.Note(state.maps);
  recognition_.SetGroup(state.group, state.revision, state.maps);
  ReleaseHeldIfCaughtUp();
}

void PlaceRecognitionProcess::OnResendRequest(const ResendRequest& request) {
  if (request.channel != channels::kPlaceMatch || request.requester == node_.name()) {
    return;
  }
  const SeqGap& range = request.range;
  const auto sent = sent_.find(range.map);
  if (sent == sent_.end()) {
    return;
  }
  for (auto it = sent->second.lower_bound(range.from_seq);
       it != sent->second.end() && it->first <= range.to_seq; ++it) {
    Retransmit(node_, request.requester, request.channel, it->second);
  }
}

void PlaceRecognitionProcess::AskForGaps(int64_t now_utime) {
  for (const SeqGap& gap : keyframes_.Gaps()) {
    Asked& asked = asked_[gap.map];
    if (asked.next == gap.from_seq && now_utime < asked.utime + kRetransmissionTimeout_us) {
      continue;
    }
    asked = {gap.from_seq, now_utime};
    const SeqGap part{gap.map, gap.from_seq,
                      std::min(gap.to_seq, gap.from_seq + kMaxKeyframesPerRequest - 1)};
    if (catching_up_) {  // first, so that they are here when the keyframes come
      RequestRetransmission(node_, std::string(channels::kPlaceMatch), part);
    }
    RequestRetransmission(node_, channels::Keyframe(gap.map.agent_id), part);
  }
}

void PlaceRecognitionProcess::PublishStatus(int64_t now_utime) {
  const PlaceRecognition::Counters& counters = recognition_.counters();
  node_.Set("keyframes", counters.keyframes);
  node_.Set("places", counters.places);
  node_.Set("candidates_own", counters.candidates_own);
  node_.Set("candidates_other", counters.candidates_other);
  node_.Set("rejected_matching", counters.rejected_matching);
  node_.Set("rejected_epipolar", counters.rejected_epipolar);
  node_.Set("rejected_surplus", counters.rejected_surplus);
  const auto waiting = static_cast<int64_t>(keyframes_.parked() + held_.size());
  node_.PublishStatus(
      now_utime, waiting,
      fmt::format("{} keyframes, {} candidates in own maps, {} in others", counters.keyframes,
                  counters.candidates_own, counters.candidates_other));
}

}  // namespace pangea

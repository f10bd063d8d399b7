#include "place_recognition/place_recognition_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/catch_up_messages.h"
#include "common/channels.h"
#include "common/messages.h"

namespace pangea {
namespace {

constexpr int64_t kAskAgainAfter_us = 500'000;
constexpr int64_t kStatusInterval_us = 1'000'000;
// At 28 kB a keyframe a request's answers fit the receive buffer.
constexpr int32_t kMaxKeyframesPerRequest = 50;
// Bounds: of matches kept to be sent again (then the oldest go), and of what waits in a catch-up
// (then it is worked off at once).
constexpr size_t kMaxSentPerMap = 2000;
constexpr size_t kMaxHeld = 2000;
constexpr size_t kMaxKnownMatches = 100'000;
// Nobody answers: what waits is worked off without what is missing.
constexpr int kGiveUpCatchingUpTicks = 50;

}  // namespace

PlaceRecognitionProcess::PlaceRecognitionProcess(Bus& bus, const PlaceRecognitionOptions& options)
    : node_(bus, "place_recognition"), recognition_(options) {
  node_.Subscribe<keyframe_t>(
      std::string(channels::kAllKeyframes),
      [this](const std::string&, const keyframe_t& message) { OnKeyframe(message); });
  node_.Subscribe<map_state_t>(
      std::string(channels::kMapState),
      [this](const std::string&, const map_state_t& message) { OnMapState(message); });
  node_.Subscribe<have_t>(std::string(channels::kHave),
                          [this](const std::string&, const have_t& message) { OnHave(message); });
  node_.Subscribe<again_t>(
      channels::Again(node_.name()),
      [this](const std::string&, const again_t& message) { OnAgain(message); });
  node_.Subscribe<resend_request_t>(
      std::string(channels::kResendRequest),
      [this](const std::string&, const resend_request_t& message) { OnResendRequest(message); });
}

void PlaceRecognitionProcess::Tick(int64_t now_utime) {
  AskForGaps(now_utime);
  for (const MapId& map : missing_states_.Due(now_utime)) {
    AskForState(node_, map);
  }
  if (catching_up_ && ++ticks_without_keyframe_ > kGiveUpCatchingUpTicks) {
    ReleaseHeld();
  }
  if (now_utime >= next_status_utime_) {
    next_status_utime_ = now_utime + kStatusInterval_us;
    PublishStatus(now_utime);
  }
}

void PlaceRecognitionProcess::OnKeyframe(const keyframe_t& message) {
  Parsed<Keyframe> parsed = Parse(message);
  if (!parsed.value) {
    node_.Refuse(parsed.refused);
    return;
  }
  const KeyframeId id = parsed.value->id;
  const std::optional<OdometryEdge>& edge = parsed.value->edge;
  if (edge && edge->from_seq < id.seq - 1) {
    // What lies between was lost for good, or the edge would begin at the keyframe before.
    HandleAll(keyframes_.Skip({id.map, edge->from_seq + 1, id.seq - 1}));
  }
  HandleAll(keyframes_.Add(id.map, id.seq, std::move(*parsed.value)));
}

void PlaceRecognitionProcess::HandleAll(const std::vector<Keyframe>& ready) {
  ticks_without_keyframe_ = 0;
  for (const Keyframe& keyframe : ready) {
    Handle(keyframe);
  }
  if (catching_up_ && (keyframes_.Gaps().empty() || held_.size() > kMaxHeld)) {
    ReleaseHeld();
  }
}

void PlaceRecognitionProcess::Handle(const Keyframe& keyframe) {
  if (const auto known = known_matches_.extract(keyframe.id)) {
    recognition_.Remember(keyframe, known.mapped());
    node_.Count("matches_of_the_journal");
  } else if (catching_up_) {
    held_.push_back(keyframe);
  } else {
    Recognise(keyframe);
  }
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

void PlaceRecognitionProcess::ReleaseHeld() {
  catching_up_ = false;
  known_matches_.clear();
  for (; !held_.empty(); held_.pop_front()) {
    Recognise(held_.front());
  }
}

void PlaceRecognitionProcess::OnHave(const have_t& message) {
  const Parsed<Have> have = Parse(message);
  if (!have.value) {
    node_.Refuse(have.refused);
    return;
  }
  for (const auto& [map, highest_seq] : have.value->highest_seq) {
    // A map we know nothing of, yet the journal does: we are the one who came late.
    if (keyframes_.next(map) == 0) {
      catching_up_ = true;
      missing_states_.Announce(map);
    }
    keyframes_.Announce(map, highest_seq);
  }
  for (const SeqGap& gap : have.value->gaps) {
    HandleAll(keyframes_.Skip(gap));
  }
}

void PlaceRecognitionProcess::OnAgain(const again_t& message) {
  const auto* bytes = reinterpret_cast<const uint8_t*>(message.data.data());
  const Bytes data(bytes, message.data.size());
  keyframe_t keyframe{};
  place_match_t match{};
  if (message.channel == channels::kPlaceMatch && DecodeMessage(data, &match)) {
    Parsed<PlaceMatch> parsed = Parse(match);
    if (!parsed.value) {
      node_.Refuse(parsed.refused);
    } else if (parsed.value->query.seq >= keyframes_.next(parsed.value->query.map) &&
               known_matches_.size() < kMaxKnownMatches) {
      known_matches_.insert_or_assign(parsed.value->query, std::move(*parsed.value));
    }
  } else if (message.channel.starts_with("KEYFRAME_") && DecodeMessage(data, &keyframe)) {
    OnKeyframe(keyframe);
  } else {
    node_.Refuse("again_t: not what was asked for");
  }
}

void PlaceRecognitionProcess::OnMapState(const map_state_t& message) {
  const Parsed<MapState> parsed = Parse(message);
  if (!parsed.value) {
    node_.Refuse(parsed.refused);
    return;
  }
  missing_states_.Note(parsed.value->maps);
  recognition_.SetGroup(parsed.value->group, parsed.value->revision, parsed.value->maps);
}

void PlaceRecognitionProcess::OnResendRequest(const resend_request_t& message) {
  if (message.channel != channels::kPlaceMatch || message.requester == node_.name()) {
    return;
  }
  const Parsed<ResendRequest> request = Parse(message);
  if (!request.value) {
    node_.Refuse(request.refused);
    return;
  }
  const SeqGap& range = request.value->range;
  const auto sent = sent_.find(range.map);
  if (sent == sent_.end()) {
    return;
  }
  for (auto it = sent->second.lower_bound(range.from_seq);
       it != sent->second.end() && it->first <= range.to_seq; ++it) {
    again_t again{};
    again.channel = channels::kPlaceMatch;
    again.data.resize(it->second.getEncodedSize());
    again.num_bytes = static_cast<int32_t>(again.data.size());
    it->second.encode(again.data.data(), 0, static_cast<int>(again.data.size()));
    node_.Publish(channels::Again(message.requester), again);
  }
}

void PlaceRecognitionProcess::AskForGaps(int64_t now_utime) {
  for (const SeqGap& gap : keyframes_.Gaps()) {
    Asked& asked = asked_[gap.map];
    if (asked.next == gap.from_seq && now_utime < asked.utime + kAskAgainAfter_us) {
      continue;
    }
    asked = {gap.from_seq, now_utime};
    resend_request_t request{};
    request.requester = node_.name();
    request.map = ToMessage(gap.map);
    request.from_seq = gap.from_seq;
    request.to_seq = std::min(gap.to_seq, gap.from_seq + kMaxKeyframesPerRequest - 1);
    if (catching_up_) {  // first, so that they are here when the keyframes come
      request.channel = channels::kPlaceMatch;
      node_.Publish(std::string(channels::kResendRequest), request);
    }
    request.channel = channels::Keyframe(gap.map.agent_id);
    node_.Publish(std::string(channels::kResendRequest), request);
    node_.NoteResendAsked(request.to_seq - request.from_seq + 1);
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

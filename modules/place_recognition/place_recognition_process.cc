#include "place_recognition/place_recognition_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <utility>

#include "bus/record_status.h"
#include "messages/catch_up_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr uint32_t kCheckpointFormat = 5;
// Bounds: on matches kept for retransmission (beyond it the oldest are dropped), on keyframes that
// wait in a catch-up or for their turn (beyond it the first are recognised at once), and on the
// journal's matches that wait for their keyframes (beyond it keyframes are recognised again): as
// many as max_keyframes may be, with about 300 bytes each.
constexpr size_t kMaxSentPerMap = 2000;
constexpr size_t kMaxHeld = 2000;
constexpr size_t kMaxKnownMatches = 1'000'000;

}  // namespace

PlaceRecognitionProcess::PlaceRecognitionProcess(Bus& bus, const PlaceRecognitionOptions& options,
                                                 const std::shared_ptr<RecordStore>& records,
                                                 const CheckpointPlace& checkpoint)
    : node_(bus, "place_recognition"),
      records_(std::make_shared<JournalRecords>(records, CornersRecord)),
      recognition_(options, records_),
      journal_(node_,
               {.in_order = true, .matches = JournalFollower::Which::kOfFormerRuns, .states = true},
               {.keyframe = std::bind_front(&PlaceRecognitionProcess::OnKeyframe, this),
                .match = std::bind_front(&PlaceRecognitionProcess::OnKnownMatch, this),
                .handled = [this] { ReleaseHeldIfCaughtUp(); }},
               {.place = checkpoint,
                .format = kCheckpointFormat,
                .save = std::bind_front(&PlaceRecognition::Save, &recognition_),
                .restore = std::bind_front(&PlaceRecognition::Restore, &recognition_),
                .keyframe_is_complete =
                    [this](const KeyframeId& id) { return known_matches_.contains(id); }},
               records_) {
  node_.Listen<map_state_t>(channels::kMapState,
                            std::bind_front(&PlaceRecognitionProcess::OnMapState, this));
  node_.Listen<resend_request_t>(channels::kResendRequest,
                                 std::bind_front(&PlaceRecognitionProcess::OnResendRequest, this));
}

void PlaceRecognitionProcess::Tick(int64_t now_utime) {
  journal_.Tick(now_utime);
  ReleaseHeldIfCaughtUp();
  if (node_.StatusIsDue(now_utime)) {
    PublishStatus(now_utime);
  }
}

void PlaceRecognitionProcess::OnKeyframe(const Keyframe& keyframe) {
  if (const auto known = known_matches_.extract(keyframe.id)) {
    recognition_.Remember(keyframe, known.mapped());
    node_.Count("matches_of_the_journal");
  } else {
    held_.push_back(keyframe);
  }
}

void PlaceRecognitionProcess::RecogniseHeld() {
  while (held_.size() > kMaxHeld) {
    RecogniseNext();
  }
  if (!held_.empty() && !journal_.reading()) {
    node_.WorkWhenIdle([this] { return RecogniseNext(); });
  }
}

bool PlaceRecognitionProcess::RecogniseNext() {
  if (held_.empty() || journal_.catching_up()) {
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
  sent.insert_or_assign(keyframe.id.seq, Record(EncodeMessage(message), records_.get()));
  if (sent.size() > kMaxSentPerMap) {
    sent.erase(sent.begin());
  }
}

void PlaceRecognitionProcess::ReleaseHeldIfCaughtUp() {
  if (held_.size() > kMaxHeld) {
    journal_.StopCatchingUp();
  }
  // Matches received before any catch-up are kept: a replay delivers them before their keyframes.
  if (std::exchange(was_catching_up_, journal_.catching_up()) && !was_catching_up_) {
    known_matches_.clear();
  }
  if (!was_catching_up_) {
    RecogniseHeld();
  }
}

bool PlaceRecognitionProcess::OnKnownMatch(PlaceMatch match) {
  const KeyframeId query = match.query;
  if (query.seq >= journal_.next(query.map) && known_matches_.size() < kMaxKnownMatches) {
    // Remember needs only the ids of the candidates.
    match.rejected = {};
    for (PlaceCandidate& candidate : match.candidates) {
      candidate.corner_matches = {};
    }
    known_matches_.insert_or_assign(query, std::move(match));
  }
  return true;
}

void PlaceRecognitionProcess::OnMapState(const MapState& state) {
  journal_.NoteStates(state.maps);
  recognition_.Take(state);
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
    const auto record = it->second.Bytes(records_.get());
    place_match_t message{};
    if (record && DecodeMessage(*record, &message)) {
      Retransmit(node_, request.requester, request.channel, message);
    }
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
  const auto waiting = static_cast<int64_t>(journal_.num_buffered() + held_.size());
  node_.PublishStatus(
      now_utime, waiting,
      fmt::format("{} keyframes, {} candidates in own maps, {} in others{}", counters.keyframes,
                  counters.candidates_own, counters.candidates_other,
                  NoteRecords(recognition_.store_counters(), records_.get(), &node_)));
}

}  // namespace pangea

#include "cluster/worker_bridge.h"

#include <fmt/format.h>

#include <functional>
#include <utility>

#include "bus/retransmission/missing.h"
#include "core/server_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr int64_t kRoundInterval_us = 20'000;
// How often a match is checked for the earlier results that it waits for, and the longest wait. The
// matches of a worker that died come after 5 s.
constexpr int64_t kWait_us = 50'000;
constexpr int64_t kMaxWait_us = 15'000'000;
constexpr char kHandler[] = "agent_handler";

using Kind = SiteStreams::Kind;

// The process that verifies candidates of this kind and must know their results.
std::string VerifierOf(PlaceKind kind) {
  return kind == PlaceKind::kIntra ? "inter_map_ba" : "fusion";
}

}  // namespace

WorkerBridge::WorkerBridge(Bus& bus, SiteStreams& streams, size_t max_matches)
    : node_(bus, "bridge"),
      as_handler_(bus, kHandler),
      streams_(streams),
      max_matches_(max_matches),
      pending_(streams),
      keyframes_(streams.Keyframes()),
      results_(streams.Results()) {
  streams_.ListenToHave();
  for (const Kind kind : {Kind::kKeyframe, Kind::kMatch, Kind::kResult}) {
    streams_.ListenToStored(kind);
  }
  // The verifiers' options go to the site's journal, so that a replay verifies with the same ones.
  node_.Subscribe<options_t>(std::string(channels::kAllOptions),
                             [this](const std::string&, const options_t& options) {
                               streams_.PublishOptions(options.process, EncodeMessage(options));
                             });
  node_.Listen<constraint_t>(channels::kConstraint, std::bind_front(&WorkerBridge::OnResult, this));
  node_.Subscribe<again_t>(
      channels::Again(kHandler),
      [this](const std::string&, const again_t& again) { OnRetransmission(again); });
  node_.Listen<resend_request_t>(channels::kResendRequest,
                                 std::bind_front(&WorkerBridge::OnResendRequest, this));
}

WorkerBridge::~WorkerBridge() {
  for (const std::string& ack_subject : outstanding_.AckSubjects()) {
    streams_.Nak(ack_subject);
  }
}

void WorkerBridge::OnRetransmission(const again_t& again) {
  TakeRetransmission<constraint_t>(node_, again, std::bind_front(&WorkerBridge::OnResult, this));
}

void WorkerBridge::OnResult(const Constraint& result) {
  if (outstanding_.Lacks(result.Id())) {
    to_store_.try_emplace(result.Id(), streams_.EntryOf(result));
    StoreResults();
  }
}

void WorkerBridge::StoreResults() {
  while (!to_store_.empty()) {
    const auto& [constraint_id, entry] = *to_store_.begin();
    const SiteStreams::Stored stored = streams_.Store(entry);
    if (stored == SiteStreams::Stored::kUnreachable) {
      return;
    }
    if (stored == SiteStreams::Stored::kNew) {
      ++num_results_;
      node_.Count("results");
    }
    NoteStored(constraint_id);
    to_store_.erase(to_store_.begin());
  }
}

void WorkerBridge::NoteStored(int64_t constraint_id) {
  if (auto ack_subject = outstanding_.NoteStored(constraint_id)) {
    done_.push_back(*std::move(ack_subject));
  }
}

void WorkerBridge::OnResendRequest(const ResendRequest& request) {
  const bool is_keyframes = request.channel.starts_with(channels::kKeyframePrefix);
  const bool is_results = request.channel == channels::kConstraint;
  if ((!is_keyframes && !is_results) || requests_.size() >= kMaxRequests) {
    return;
  }
  requests_.push_back({request.requester, request.range, std::nullopt});
  if (is_results) {
    requests_.back().results = streams_.ResultsOf(request.range.map);
  }
}

bool WorkerBridge::AnswerKeyframe(Request* request) {
  KeyframeMessage keyframe{};
  const auto message = streams_.FindKeyframe({request->range.map, request->range.from_seq});
  if (message && DecodeMessage(message->data, &keyframe)) {
    Retransmit(node_, request->requester, channels::Keyframe(request->range.map.agent_id),
               keyframe);
  }
  return ++request->range.from_seq <= request->range.to_seq;
}

bool WorkerBridge::AnswerResult(Request* request) {
  constraint_t result{};
  const auto message = request->results->Next();
  if (message && DecodeMessage(message->data, &result) &&
      result.to.seq >= request->range.from_seq && result.to.seq <= request->range.to_seq) {
    Retransmit(node_, request->requester, std::string(channels::kConstraint), result);
  }
  return message.has_value();
}

void WorkerBridge::AnswerRequests() {
  for (int i = 0; i < kKeyframes && !requests_.empty(); ++i) {
    Request& request = requests_.front();
    const bool more = request.results ? AnswerResult(&request) : AnswerKeyframe(&request);
    if (!more) {
      requests_.pop_front();
    }
  }
}

void WorkerBridge::ListenToStored(int64_t now_utime) {
  for (const auto& [kind, watch] : {std::pair{Kind::kKeyframe, &keyframes_watch_},
                                    {Kind::kMatch, &matches_watch_},
                                    {Kind::kResult, &results_watch_}}) {
    if (streams_.HeardOfStored(kind)) {
      watch->NoteStored(now_utime);
    }
  }
}

void WorkerBridge::PassKeyframes(int64_t now_utime) {
  for (int i = 0; i < kKeyframes && keyframes_watch_.IsDue(now_utime); ++i) {
    const auto message = keyframes_.Next();
    if (!message) {
      has_keyframes_ = has_keyframes_ || streams_.connected();
      return keyframes_watch_.NoteEmpty(now_utime);
    }
    KeyframeMessage keyframe{};
    if (DecodeMessage(message->data, &keyframe)) {
      node_.Publish(channels::Keyframe(keyframe.id.map.agent_id), keyframe);
      node_.Count("keyframes");
    } else {
      node_.Refuse("keyframe in the stream does not decode");
    }
  }
}

// HAVE is published only after its keyframes, because verifiers ask for all keyframes that they
// lack.
void WorkerBridge::PassHave() {
  while (const auto heard = streams_.NextHave()) {
    if (has_keyframes_) {
      node_.bus().Publish(std::string(channels::kHave), heard->data);
    }
  }
}

void WorkerBridge::PassResults(int64_t now_utime) {
  for (int i = 0; i < kResults; ++i) {
    const auto message = results_.Next();
    if (!message) {
      return results_watch_.NoteEmpty(now_utime);
    }
    constraint_t data{};
    if (!DecodeMessage(message->data, &data)) {
      node_.Refuse("result in the stream does not decode");
      continue;
    }
    node_.Take(data, [&](const Constraint& result) {
      NoteStored(result.Id());
      Retransmit(node_, VerifierOf(result.kind), std::string(channels::kConstraint), data);
    });
  }
}

// Whether our verifiers know all results that the match's candidates wait for. A match that is no
// longer pending has all its results in the stream, so the results are read after that check.
bool WorkerBridge::KnowsWhatItRestsOn(const PlaceMatch& match, int64_t now_utime) {
  if (!pending_.LetPass(match, now_utime)) {
    return false;
  }
  // A node of NATS that lags behind may not have all results, so their end is compared.
  const auto end = streams_.ResultsEnd();
  PassResults(now_utime);
  return end && results_.HasHad(*end);
}

void WorkerBridge::TakeMatches(int64_t now_utime) {
  const bool waits = now_utime < given_back_utime_ + 4 * kWait_us;
  while (outstanding_.size() < max_matches_ && (waits || matches_watch_.IsDue(now_utime))) {
    const auto delivery = streams_.FetchMatch();
    if (!delivery) {
      return matches_watch_.NoteEmpty(now_utime);
    }
    auto match = ParseMessage<place_match_t>(delivery->data);
    if (!match.value) {
      node_.Refuse("match in the queue: " + match.refused);
      done_.push_back(delivery->ack_subject);
    } else if (now_utime > delivery->stored_utime + kMaxWait_us ||
               KnowsWhatItRestsOn(*match.value, now_utime)) {
      TakeMatch(*std::move(match.value), delivery->ack_subject, now_utime);
    } else {
      given_back_utime_ = now_utime;
      return streams_.Nak(delivery->ack_subject, kWait_us);
    }
  }
}

// Candidates whose result another worker, which may have died, has stored are left out.
void WorkerBridge::TakeMatch(PlaceMatch match, const std::string& ack_subject, int64_t now_utime) {
  std::erase_if(match.candidates, [&](const PlaceCandidate& candidate) {
    return streams_.FindResult(match.query, ConstraintId(match.query, candidate)).has_value();
  });
  if (match.candidates.empty()) {
    return done_.push_back(ack_subject);
  }
  node_.Publish(std::string(channels::kPlaceMatch), ToMessage(match));
  node_.Count("matches");
  outstanding_.Add(std::move(match), ack_subject, now_utime);
}

void WorkerBridge::AskForOverdue(int64_t now_utime) {
  for (const PlaceMatch& match : outstanding_.Overdue(now_utime)) {
    ResultNames names{match.query.map, {}};
    for (const PlaceCandidate& candidate : match.candidates) {
      const int64_t constraint_id = ConstraintId(match.query, candidate);
      names.results.emplace_back(match.query.seq, constraint_id);
      // NATS did not answer when the match was taken; our verifiers know this result from another
      // worker.
      if (streams_.FindResult(match.query, constraint_id)) {
        NoteStored(constraint_id);
      }
    }
    RequestResults(as_handler_, names);
    node_.Publish(std::string(channels::kPlaceMatch), ToMessage(match));
    node_.Count("asked_again");
  }
}

void WorkerBridge::BetweenMessages(int64_t now_utime) {
  if (now_utime < next_round_utime_) {
    return;
  }
  next_round_utime_ = now_utime + kRoundInterval_us;
  ListenToStored(now_utime);
  PassKeyframes(now_utime);
  PassHave();
  if (results_watch_.IsDue(now_utime)) {
    PassResults(now_utime);
  }
  StoreResults();
  std::erase_if(
      done_, [this](const std::string& ack_subject) { return streams_.Acknowledge(ack_subject); });
  if (has_keyframes_) {
    TakeMatches(now_utime);
  }
  AnswerRequests();
}

void WorkerBridge::Tick(int64_t now_utime) {
  AskForOverdue(now_utime);
  if (node_.StatusIsDue(now_utime)) {
    for (const std::string& ack_subject : outstanding_.AckSubjects()) {
      streams_.InProgress(ack_subject);
    }
    PublishStatus(now_utime);
  }
}

void WorkerBridge::PublishStatus(int64_t now_utime) {
  node_.PublishStatus(
      now_utime, static_cast<int64_t>(outstanding_.num_lacking() + done_.size()),
      fmt::format("worker: {} of {} matches taken, {} results awaited, {} stored{}",
                  outstanding_.size(), max_matches_, outstanding_.num_lacking(), num_results_,
                  streams_.connected() ? "" : "; NATS DOES NOT ANSWER"));
}

}  // namespace pangea

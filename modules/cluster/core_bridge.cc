#include "cluster/core_bridge.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <string>

#include "bus/retransmission/missing.h"
#include "core/server_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr int64_t kPollInterval_us = 20'000;
constexpr char kJournalOwner[] = "agent_handler";
constexpr size_t kMaxAsked = 5000;

}  // namespace

CoreBridge::CoreBridge(Bus& bus, SiteStreams& streams, SiteLease& lease)
    : node_(bus, "bridge"),
      streams_(streams),
      lease_(lease),
      shipper_(streams, lease.term(), StoreTerm(streams, lease.term())),
      journal_(node_,
               {.matches = JournalFollower::Which::kAll,
                .results = JournalFollower::Which::kOfFormerRuns},
               {.keyframe = [](const Keyframe&) {},
                .match = std::bind_front(&CoreBridge::TakeMatch, this),
                .result = std::bind_front(&CoreBridge::OnFormerResult, this)}),
      results_(streams.Results()) {
  streams_.ListenToOptions();
  streams_.ListenToStored(SiteStreams::Kind::kResult);
  node_.Listen<journal_file_t>(channels::kJournalFile,
                               std::bind_front(&CoreBridge::OnJournalFile, this));
  node_.SubscribeBytes(std::string(channels::kHave),
                       [this](const std::string&, Bytes data) { streams_.PublishHave(data); });
  node_.Listen<verdict_request_t>(channels::kVerificationRequest,
                                  std::bind_front(&CoreBridge::OnVerificationRequest, this));
}

// Ships at once, because agents wait for the acknowledgement.
void CoreBridge::OnJournalFile(const JournalFile& file) {
  shipper_.OnJournalFile(file);
  ShipJournal();
}

void CoreBridge::ShipJournal() {
  shipper_.Ship();
  const auto shipped = shipper_.shipped();
  if (!shipped || !lease_.fresh(now_utime_)) {
    return;
  }
  if (shipped->state.num_bytes != told_bytes_ || now_utime_ >= next_told_utime_) {
    told_bytes_ = shipped->state.num_bytes;
    next_told_utime_ = now_utime_ + kToldInterval_us;
    node_.Publish(std::string(channels::kJournalReplicated), ToMessage(*shipped));
  }
}

void CoreBridge::ToStore(SiteStreams::Entry entry) {
  if (to_store_.size() >= kMaxUnstored) {
    throw std::runtime_error(fmt::format(
        "NATS takes nothing, and {} messages wait for it: start NATS, then this bridge again; "
        "the journal has them",
        kMaxUnstored));
  }
  to_store_.push_back(std::move(entry));
}

// A match whose results are all in the journal is not given to workers.
bool CoreBridge::TakeMatch(const PlaceMatch& match) {
  const bool is_work = std::ranges::any_of(match.candidates, [&](const PlaceCandidate& candidate) {
    return !in_journal_.contains(ConstraintId(match.query, candidate));
  });
  if (is_work && !journal_.HasMatch(match.query)) {
    ToStore(streams_.EntryOf(match));
  }
  return true;
}

void CoreBridge::OnFormerResult(const Constraint& result) {
  if (in_journal_.insert(result.Id()).second) {
    ToStore(streams_.EntryOf(result));
  }
}

void CoreBridge::OnVerificationRequest(const VerificationRequest& request) {
  if (request.requester != kJournalOwner) {
    return;
  }
  for (const auto& [seq, constraint_id] : request.names.results) {
    if (asked_.size() < kMaxAsked) {
      asked_.emplace_back(KeyframeId{request.names.map, seq}, constraint_id);
    }
  }
}

void CoreBridge::StoreAll() {
  for (int i = 0; i < kPiece && !to_store_.empty(); ++i) {
    const SiteStreams::Entry& entry = to_store_.front();
    const SiteStreams::Stored stored = streams_.Store(entry);
    if (stored == SiteStreams::Stored::kUnreachable) {
      return;
    }
    if (stored == SiteStreams::Stored::kTooLarge) {
      node_.Refuse("larger than NATS takes (max_payload)");
    } else if (stored == SiteStreams::Stored::kNew) {
      node_.Count("stored");
    }
    to_store_.pop_front();
  }
}

// Not while the journal is being read, because it may already have most of these results.
void CoreBridge::PublishResults() {
  if (streams_.HeardOfStored(SiteStreams::Kind::kResult)) {
    results_watch_.NoteStored(now_utime_);
  }
  for (int i = 0; i < kPiece && !journal_.reading() && results_watch_.IsDue(now_utime_); ++i) {
    const auto message = results_.Next();
    if (!message) {
      return results_watch_.NoteEmpty(now_utime_);
    }
    constraint_t result{};
    if (!DecodeMessage(message->data, &result)) {
      node_.Refuse("result in the stream does not decode");
    } else if (in_journal_.insert(result.id).second) {
      node_.Publish(std::string(channels::kConstraint), result);
      node_.Count("results");
    }
  }
}

void CoreBridge::PublishOptions() {
  while (const auto heard = streams_.NextOptions()) {
    options_t options{};
    if (DecodeMessage(heard->data, &options)) {
      node_.Publish(channels::Options(options.process), options);
    }
  }
}

void CoreBridge::AnswerRequests() {
  for (int i = 0; i < kPiece && !asked_.empty(); ++i, asked_.pop_front()) {
    const auto& [query, constraint_id] = asked_.front();
    constraint_t result{};
    const auto message = streams_.FindResult(query, constraint_id);
    if (message && DecodeMessage(message->data, &result)) {
      Retransmit(node_, kJournalOwner, std::string(channels::kConstraint), result);
      node_.Count("retransmitted");
    }
  }
}

void CoreBridge::BetweenMessages(int64_t now_utime) {
  now_utime_ = now_utime;
  ShipJournal();
  StoreAll();
  if (now_utime >= next_poll_utime_) {
    PublishResults();
    PublishOptions();
    AnswerRequests();
    next_poll_utime_ = now_utime + kPollInterval_us;
  }
}

void CoreBridge::Tick(int64_t now_utime) {
  if (!lease_.Renew(now_utime)) {
    throw LeaseLost(fmt::format("another core has the site: {}", lease_.seen_holder()));
  }
  journal_.Tick(now_utime);
  if (node_.StatusIsDue(now_utime)) {
    PublishStatus(now_utime);
  }
}

void CoreBridge::PublishStatus(int64_t now_utime) {
  const auto to_store = static_cast<int64_t>(to_store_.size());
  node_.Set("bytes_to_replicate", shipper_.bytes_to_ship());
  node_.Set("events_too_large", shipper_.num_too_large());
  const auto queue = streams_.MatchQueueState();
  if (!queue) {
    return node_.PublishStatus(now_utime, to_store + 1,
                               fmt::format("NATS DOES NOT ANSWER; {} messages wait", to_store));
  }
  const auto waiting = static_cast<int64_t>(queue->waiting);
  node_.Set("matches_waiting", waiting);
  node_.Set("matches_taken", queue->unacknowledged);
  node_.PublishStatus(
      now_utime, to_store + waiting + queue->unacknowledged,
      fmt::format("core: {} matches wait for a worker, {} are with workers; {} messages to store",
                  waiting, queue->unacknowledged, to_store));
}

}  // namespace pangea

#include "loop_verification/candidate_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <variant>

#include "bus/record_status.h"
#include "core/server_messages.h"
#include "messages/catch_up_messages.h"
#include "messages/channels.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr uint32_t kCheckpointFormat = 6;
constexpr char kJournalOwner[] = "agent_handler";

}  // namespace

CandidateProcess::CandidateProcess(Bus& bus, const std::string& name, PlaceKind kind,
                                   const LoopVerifierOptions& options,
                                   const std::shared_ptr<RecordStore>& records,
                                   const CheckpointPlace& checkpoint, int threads)
    : node_(bus, name),
      kind_(kind),
      records_(std::make_shared<JournalRecords>(records, LoopVerifier::RecordOf)),
      verifier_(options, records_),
      threads_(options.alignment, threads),
      journal_(node_,
               {.matches = JournalFollower::Which::kAll,
                .results = JournalFollower::Which::kOfFormerRuns},
               {.keyframe = [this](Keyframe keyframe) { verifier_.Add(std::move(keyframe)); },
                .match = std::bind_front(&CandidateProcess::TakeMatch, this),
                .result = std::bind_front(&CandidateProcess::OnFormerResult, this),
                .have = std::bind_front(&CandidateProcess::OnHave, this),
                .handled = [this] { CollectReady(); }},
               {.place = checkpoint,
                .format = kCheckpointFormat,
                .save = std::bind_front(&CandidateProcess::Save, this),
                .restore = std::bind_front(&CandidateProcess::Restore, this),
                .match_is_complete = std::bind_front(&CandidateProcess::IsComplete, this)},
               records_) {
  node_.Listen<verdict_request_t>(channels::kVerificationRequest,
                                  std::bind_front(&CandidateProcess::OnVerificationRequest, this));
}

// The journal also has the results of the other kind. While they run, neither process learns those
// of the other.
void CandidateProcess::OnFormerResult(const Constraint& result) {
  const bool of_the_other = !IsMine(result.kind) && result.kind != PlaceKind::kDerived;
  if (!of_the_other && verified_.insert(result.Id()).second) {
    verifier_.NoteVerified(result);
    ForgetAhead(result.to);
  }
}

void CandidateProcess::Save(ByteWriter* writer) const {
  writer->Put(std::vector<int64_t>(verified_.begin(), verified_.end()));
  verifier_.Save(writer);
}

bool CandidateProcess::Restore(ByteReader* reader) {
  std::vector<int64_t> verified;
  reader->Get(&verified);
  if (!verifier_.Restore(reader)) {
    return false;
  }
  verified_ = {verified.begin(), verified.end()};
  return true;
}

bool CandidateProcess::IsComplete(const PlaceMatch& match) const {
  return std::ranges::all_of(match.candidates, [&](const PlaceCandidate& candidate) {
    return !IsMine(candidate.kind) || verified_.contains(ConstraintId(match.query, candidate));
  });
}

bool CandidateProcess::TakeMatch(const PlaceMatch& match) {
  if (journal_.HasMatch(match.query)) {
    return true;
  }
  if (num_pending() + match.candidates.size() > kMaxWaiting) {
    node_.Refuse("too many candidates wait");
    return false;
  }
  ForgetAhead(match.query);
  for (const PlaceCandidate& candidate : match.candidates) {
    if (IsMine(candidate.kind) && !verified_.contains(ConstraintId(match.query, candidate))) {
      waiting_.emplace(std::make_pair(match.query, candidate.match), candidate);
    }
  }
  return true;
}

void CandidateProcess::OnHave(const Have& have) {
  for (const SeqGap& gap : have.gaps) {
    verifier_.NoteLost(gap.map, gap.from_seq, gap.to_seq);
  }
}

void CandidateProcess::OnVerificationRequest(const VerificationRequest& request) {
  if (request.requester != kJournalOwner) {
    return;
  }
  std::set<int64_t> asked;
  for (const auto& [seq, constraint_id] : request.names.results) {
    asked.insert(constraint_id);
  }
  for (const Constraint& constraint : sent_) {
    if (asked.contains(constraint.Id())) {
      Retransmit(node_, request.requester, std::string(channels::kConstraint),
                 ToMessage(constraint));
      node_.Count("retransmitted");
    }
  }
}

void CandidateProcess::CollectReady() {
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    const KeyframeId& query = it->first.first;
    if (verifier_.Ready(query, it->second)) {
      ready_.emplace_back(query, std::move(it->second));
      it = waiting_.erase(it);
    } else {
      ++it;
    }
  }
  if (!ready_.empty() && !journal_.reading()) {
    node_.WorkWhenIdle([this] { return VerifyNext(); });
  }
}

PendingQueries CandidateProcess::Pending() const {
  PendingQueries pending;
  for (const auto& [ids, candidate] : waiting_) {
    pending.Add(ids.first);
  }
  for (const auto& [query, candidate] : ready_) {
    pending.Add(query);
  }
  return pending;
}

// The first ready candidate that depends on no pending one; none if all do.
std::deque<CandidateProcess::Ready>::iterator CandidateProcess::NextReady() {
  const PendingQueries pending = Pending();
  return std::ranges::find_if(ready_, [&](const Ready& ready) {
    return !pending.Precede(ready.first, ready.second.match);
  });
}

void CandidateProcess::Verify(std::deque<Ready>::iterator next) {
  const PendingQueries pending = Pending();
  std::vector<VerificationTask> tasks;
  for (; next != ready_.end() && tasks.size() < threads_.max_tasks(); ++next) {
    const auto& [query, candidate] = *next;
    const std::pair ids(query, candidate.match);
    if (results_ahead_.contains(ids) || pending.Precede(query, candidate.match)) {
      continue;
    }
    auto prepared = verifier_.Prepare(query, candidate);
    if (auto* task = std::get_if<VerificationTask>(&prepared)) {
      tasks.push_back(std::move(*task));
    } else {
      results_ahead_.emplace(ids, std::get<Constraint>(prepared));
    }
  }
  for (const Constraint& result : threads_.Run(tasks)) {
    results_ahead_.emplace(std::pair(result.to, result.from), result);
  }
}

// Forgets results that rest on those of this query: more of them are to come, or came from a former
// run.
void CandidateProcess::ForgetAhead(const KeyframeId& query) {
  std::erase_if(results_ahead_, [&query](const auto& result) {
    return RestsOn(result.first.first, result.first.second, query);
  });
}

bool CandidateProcess::VerifyNext() {
  const auto next = NextReady();
  if (next == ready_.end()) {
    return false;
  }
  const std::pair ids(next->first, next->second.match);
  // The journal may deliver the result of a former run after its match.
  const bool known = verified_.contains(ConstraintId(next->first, next->second));
  if (!known && !results_ahead_.contains(ids)) {
    Verify(next);
  }
  ready_.erase(next);
  const auto result = results_ahead_.extract(ids);
  if (!known) {
    Take(result.mapped());
  }
  return !ready_.empty();
}

void CandidateProcess::Take(const Constraint& constraint) {
  verified_.insert(constraint.Id());
  verifier_.NoteVerified(constraint);
  node_.Publish(std::string(channels::kConstraint), ToMessage(constraint));
  sent_.push_back(constraint);
  if (sent_.size() > kMaxSent) {
    sent_.pop_front();
  }
  if (constraint.accepted) {
    node_.Count("accepted");
    ++num_accepted_;
  } else {
    node_.Refuse(constraint.reason);
  }
}

void CandidateProcess::Tick(int64_t now_utime) {
  journal_.Tick(now_utime, num_pending() <= kMaxWaiting / 2);
  if (node_.StatusIsDue(now_utime)) {
    PublishStatus(now_utime);
  }
}

void CandidateProcess::PublishStatus(int64_t now_utime) {
  node_.PublishStatus(
      now_utime, static_cast<int64_t>(num_pending()),
      fmt::format("{} constraints accepted of {} candidates, {} wait for keyframes, {} for their "
                  "turn{}",
                  num_accepted_, verified_.size(), waiting_.size(), ready_.size(),
                  NoteRecords(verifier_.store_counters(), records_.get(), &node_)));
}

}  // namespace pangea

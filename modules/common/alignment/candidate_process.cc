#include "common/alignment/candidate_process.h"

#include <fmt/format.h>

#include "common/catch_up_messages.h"
#include "common/channels.h"
#include "common/messages.h"

namespace pangea {
namespace {

constexpr int64_t kSecond = 1'000'000;
constexpr char kJournalOwner[] = "agent_handler";

}  // namespace

CandidateProcess::CandidateProcess(Bus& bus, const std::string& name, PlaceKind kind,
                                   std::unique_ptr<PairJudge> judge)
    : node_(bus, name), kind_(kind), judge_(std::move(judge)) {
  node_.Subscribe<keyframe_t>(
      std::string(channels::kAllKeyframes),
      [this](const std::string&, const keyframe_t& message) { OnKeyframe(message); });
  node_.Subscribe<place_match_t>(
      std::string(channels::kPlaceMatch),
      [this](const std::string&, const place_match_t& message) { OnPlaceMatch(message); });
  node_.Subscribe<have_t>(std::string(channels::kHave),
                          [this](const std::string&, const have_t& message) { OnHave(message); });
  node_.Subscribe<again_t>(
      channels::Again(name),
      [this](const std::string&, const again_t& message) { OnAgain(message); });
  node_.Subscribe<resend_request_t>(
      std::string(channels::kResendRequest),
      [this](const std::string&, const resend_request_t& message) { OnResendRequest(message); });
}

void CandidateProcess::OnKeyframe(const keyframe_t& message) {
  Parsed<Keyframe> keyframe = Parse(message);
  if (!keyframe.value) {
    node_.Refuse(keyframe.refused);
    return;
  }
  keyframes_.Note(keyframe.value->id.map, keyframe.value->id.seq);
  judge_->Add(std::move(*keyframe.value));
  JudgeReady();
}

void CandidateProcess::OnPlaceMatch(const place_match_t& message) {
  const Parsed<PlaceMatch> match = Parse(message);
  if (!match.value) {
    node_.Refuse(match.refused);
    return;
  }
  if (waiting_.size() + match.value->candidates.size() > kMaxWaiting) {
    node_.Refuse("too many candidates wait for keyframes");
    return;
  }
  matches_.Note(match.value->query.map, match.value->query.seq);
  for (const PlaceCandidate& candidate : match.value->candidates) {
    Constraint constraint;
    constraint.from = candidate.match;
    constraint.to = match.value->query;
    constraint.kind = candidate.kind;
    if (candidate.kind == kind_ && !judged_.contains(constraint.Id())) {
      waiting_.emplace(std::make_pair(match.value->query, candidate.match), candidate);
    }
  }
  JudgeReady();
}

void CandidateProcess::OnHave(const have_t& message) {
  const Parsed<Have> have = Parse(message);
  if (!have.value) {
    node_.Refuse(have.refused);
    return;
  }
  for (const auto& [map, highest_seq] : have.value->highest_seq) {
    // Verdicts of a former run: no need to repeat them.
    if (verdicts_asked_.insert(map).second) {
      AskAgain(node_, std::string(channels::kConstraint), {map, 0, highest_seq});
    }
    keyframes_.Announce(map, highest_seq);
    matches_.Announce(map, highest_seq);
  }
  for (const SeqGap& gap : have.value->gaps) {
    judge_->NoteLost(gap.map, gap.from_seq, gap.to_seq);
    keyframes_.Skip(gap);
    matches_.Skip(gap);
  }
  if (!have.value->gaps.empty()) {
    JudgeReady();
  }
}

void CandidateProcess::OnAgain(const again_t& message) {
  const bool known =
      TakeAgain<keyframe_t>(message, [this](const keyframe_t& m) { OnKeyframe(m); }) ||
      TakeAgain<place_match_t>(message, [this](const place_match_t& m) { OnPlaceMatch(m); }) ||
      TakeAgain<constraint_t>(message, [this](const constraint_t& m) { judged_.insert(m.id); });
  if (!known) {
    node_.Refuse("again: neither keyframe, match nor constraint");
  }
}

void CandidateProcess::OnResendRequest(const resend_request_t& message) {
  const Parsed<MapId> map = Parse(message.map);
  if (message.channel != channels::kConstraint || message.requester != kJournalOwner ||
      !map.value) {
    return;
  }
  for (const Constraint& constraint : sent_) {
    if (constraint.to.map == *map.value && constraint.to.seq >= message.from_seq &&
        constraint.to.seq <= message.to_seq) {
      const constraint_t verdict = ToMessage(constraint);
      again_t again{};
      again.channel = channels::kConstraint;
      again.data.resize(static_cast<size_t>(verdict.getEncodedSize()));
      again.num_bytes = static_cast<int32_t>(again.data.size());
      verdict.encode(again.data.data(), 0, again.num_bytes);
      node_.Publish(channels::Again(message.requester), again);
    }
  }
}

void CandidateProcess::JudgeReady() {
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    const KeyframeId& query = it->first.first;
    if (!judge_->Ready(query, it->second)) {
      ++it;
      continue;
    }
    const Constraint constraint = judge_->Judge(query, it->second);
    if (judged_.insert(constraint.Id()).second) {
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
    it = waiting_.erase(it);
  }
}

void CandidateProcess::Tick(int64_t now_utime) {
  for (const SeqGap& gap : keyframes_.Due(now_utime)) {
    AskAgain(node_, channels::Keyframe(gap.map.agent_id), gap);
  }
  for (const SeqGap& gap : matches_.Due(now_utime)) {
    AskAgain(node_, std::string(channels::kPlaceMatch), gap);
  }
  if (now_utime >= next_status_utime_) {
    next_status_utime_ = now_utime + kSecond;
    const auto waiting = static_cast<int64_t>(waiting_.size());
    node_.PublishStatus(
        now_utime, waiting,
        fmt::format("{} constraints accepted of {} candidates, {} wait for keyframes",
                    num_accepted_, judged_.size(), waiting));
  }
}

}  // namespace pangea

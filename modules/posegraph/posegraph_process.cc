#include "posegraph/posegraph_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "messages/catch_up_messages.h"
#include "messages/channels.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr int64_t kSecond = 1'000'000;
constexpr int64_t kRetransmissionTimeout_us = kSecond;
constexpr int64_t kResultAfter_us = 2 * kSecond;
constexpr int64_t kMaxResultAfter_us = 60 * kSecond;
constexpr int64_t kGiveUpCatchingUp_us = 5 * kSecond;
// One request's answers must fit the receive buffer: a keyframe is about 28 kB.
constexpr int32_t kMaxKeyframesAsked = 50;
// A gap that nobody fills after so many requests is bridged.
constexpr int kMaxTimesAsked = 15;

}  // namespace

PoseGraphProcess::PoseGraphProcess(Bus& bus, const PoseGraphOptions& options,
                                   int64_t first_revision)
    : node_(bus, "posegraph"), graph_(options, first_revision) {
  node_.Listen<keyframe_t>(channels::kAllKeyframes,
                           std::bind_front(&PoseGraphProcess::OnKeyframe, this));
  node_.Listen<constraint_t>(channels::kConstraint,
                             std::bind_front(&PoseGraphProcess::OnConstraint, this));
  node_.Listen<place_match_t>(channels::kPlaceMatch,
                              std::bind_front(&PoseGraphProcess::OnPlaceMatch, this));
  node_.Listen<map_state_t>(channels::kRefinement,
                            std::bind_front(&PoseGraphProcess::OnRefinement, this));
  node_.Listen<have_t>(channels::kHave, std::bind_front(&PoseGraphProcess::OnHave, this));
  node_.Subscribe<again_t>(
      channels::Again(node_.name()),
      [this](const std::string&, const again_t& message) { OnRetransmission(message); });
  node_.Listen<resend_request_t>(channels::kResendRequest,
                                 std::bind_front(&PoseGraphProcess::OnResendRequest, this));
}

void PoseGraphProcess::OnKeyframe(Keyframe keyframe) {
  const KeyframeId id = keyframe.id;
  graph_.NoteMap(id.map);
  const int32_t from = keyframe.edge ? keyframe.edge->from_seq : id.seq - 1;
  // An edge that begins further back says that what lies between is lost for good.
  const int32_t first_lost = std::max(from + 1, keyframes_.next(id.map));
  const bool credible = id.seq - first_lost <= static_cast<int32_t>(InOrder<Item>::kMaxParked);
  for (int32_t seq = first_lost; credible && seq < id.seq; ++seq) {
    Enqueue(id.map, seq, std::nullopt);
  }
  Enqueue(id.map, id.seq, std::move(keyframe));
  SettleUnlessMoreWaits();
}

void PoseGraphProcess::Enqueue(const MapId& map, int32_t seq, Item item) {
  for (const Item& ready : keyframes_.Add(map, seq, std::move(item))) {
    if (ready) {
      ++num_arrived_;
      graph_.Take(*ready);
      ++num_unsettled_;
    } else {
      node_.NoteDropped();
    }
  }
}

void PoseGraphProcess::OnConstraint(const Constraint& constraint) {
  const int64_t id = constraint.Id();
  due_.erase(id);
  if (results_.insert(id).second) {
    ++num_arrived_;
    node_.Count(constraint.accepted ? "results_accepted" : "results_refused");
  } else {
    node_.Count("results_repeated");
  }
  graph_.Take(constraint);
  ++num_unsettled_;
  SettleUnlessMoreWaits();
}

void PoseGraphProcess::OnPlaceMatch(const PlaceMatch& match) {
  const KeyframeId& query = match.query;
  matches_.Note(query.map, query.seq);
  for (const PlaceCandidate& candidate : match.candidates) {
    Constraint promised;
    promised.from = candidate.match;
    promised.to = query;
    promised.kind = candidate.kind;
    if (!results_.contains(promised.Id()) && due_.size() < kMaxDue) {
      due_.try_emplace(promised.Id(), Due{query, now_utime_ + kResultAfter_us, kResultAfter_us});
    }
  }
  SettleUnlessMoreWaits();
}

void PoseGraphProcess::OnRefinement(MapState state, const map_state_t& message) {
  const auto whole = refinements_.Add(message.chunk, message.num_chunks, std::move(state));
  if (whole) {
    node_.Count("refinements");
    graph_.TakeRefined(*whole);
    ++num_unsettled_;
    SettleUnlessMoreWaits();
  }
}

void PoseGraphProcess::OnHave(const Have& have) {
  for (const auto& [map, highest_seq] : have.highest_seq) {
    graph_.NoteMap(map);
    // What was verified before this process started.
    if (results_requested_.insert(map).second) {
      RequestAllRetransmissions(node_, std::string(channels::kConstraint), map, highest_seq);
    }
    keyframes_.Announce(map, highest_seq);
    if (!have_received_ && keyframes_.next(map) == 0) {
      catching_up_to_[map] = highest_seq;
    }
  }
  matches_.Announce(have);
  have_received_ = true;
}

// Keyframes and matches' maps and verification results of the journal that are still to come.
int64_t PoseGraphProcess::NumToCatchUp() const {
  int64_t count = 0;
  for (const auto& [map, seq] : catching_up_to_) {
    count += std::max(0, seq + 1 - keyframes_.next(map)) + (matches_.Lacks(map, seq) ? 1 : 0);
  }
  for (const auto& [id, due] : due_) {
    const auto goal = catching_up_to_.find(due.query.map);
    const bool of_journal = goal != catching_up_to_.end() && due.query.seq <= goal->second;
    // Asked for twice by its name: the journal does not have it, it is still to be verified.
    count += of_journal && due.wait_us < 4 * kResultAfter_us ? 1 : 0;
  }
  return count;
}

void PoseGraphProcess::CatchUp(int64_t now_utime) {
  const int64_t count = NumToCatchUp();
  if (count < num_to_catch_up_ || caught_up_utime_ == 0) {
    caught_up_utime_ = now_utime;
  }
  num_to_catch_up_ = count;
  if (count == 0 || now_utime >= caught_up_utime_ + kGiveUpCatchingUp_us) {
    catching_up_to_.clear();
  }
}

void PoseGraphProcess::OnResendRequest(const ResendRequest& request) {
  if (request.channel == channels::kMapState) {
    graph_.Republish(request.range.map);
    ++num_unsettled_;
    SettleUnlessMoreWaits();
  }
}

void PoseGraphProcess::OnRetransmission(const again_t& message) {
  const bool known = TakeRetransmission<keyframe_t>(
                         node_, message, std::bind_front(&PoseGraphProcess::OnKeyframe, this)) ||
                     TakeRetransmission<place_match_t>(
                         node_, message, std::bind_front(&PoseGraphProcess::OnPlaceMatch, this)) ||
                     TakeRetransmission<constraint_t>(
                         node_, message, std::bind_front(&PoseGraphProcess::OnConstraint, this));
  if (!known) {
    node_.Refuse("again: not what was asked for");
  }
}

void PoseGraphProcess::SettleUnlessMoreWaits() {
  if (num_unsettled_ > 0 && catching_up_to_.empty() &&
      (num_unsettled_ >= kMaxUnsettled || !node_.bus().MoreWaits())) {
    num_unsettled_ = 0;
    Publish(graph_.Settle());
  }
}

void PoseGraphProcess::Publish(const PoseGraphUpdate& update) {
  for (const Correction& correction : update.corrections) {
    node_.Publish(channels::Correction(correction.map.agent_id), ToMessage(correction));
  }
  for (const MapState& state : update.states) {
    for (const map_state_t& chunk : ToMessages(state)) {
      node_.Publish(std::string(channels::kMapState), chunk);
    }
  }
}

void PoseGraphProcess::Finish() {
  num_unsettled_ = 0;
  Publish(graph_.Finish());
}

void PoseGraphProcess::Tick(int64_t now_utime) {
  now_utime_ = now_utime;
  if (!catching_up_to_.empty()) {
    CatchUp(now_utime);
  }
  SettleUnlessMoreWaits();
  AskForKeyframes(now_utime);
  for (const SeqGap& gap : matches_.Due(now_utime)) {
    RequestRetransmission(node_, std::string(channels::kPlaceMatch), gap);
  }
  RequestDueResults(now_utime);
  if (num_arrived_ != num_arrived_at_change_) {
    num_arrived_at_change_ = num_arrived_;
    last_change_utime_ = now_utime;
  } else if (num_finished_ != num_arrived_ && catching_up_to_.empty() &&
             now_utime >= last_change_utime_ + kSecond) {
    num_finished_ = num_arrived_;
    Finish();
  }
  if (now_utime >= next_status_utime_) {
    next_status_utime_ = now_utime + kSecond;
    PublishStatus(now_utime);
  }
}

void PoseGraphProcess::AskForKeyframes(int64_t now_utime) {
  for (const SeqGap& gap : keyframes_.Gaps()) {
    Asked& asked = keyframes_asked_[gap.map];
    if (asked.from_seq != gap.from_seq) {
      asked = {gap.from_seq, now_utime + kRetransmissionTimeout_us / 2, 0};
    } else if (now_utime >= asked.next_utime && asked.times >= kMaxTimesAsked) {
      Enqueue(gap.map, gap.from_seq, std::nullopt);
    } else if (now_utime >= asked.next_utime) {
      asked.next_utime = now_utime + kRetransmissionTimeout_us;
      ++asked.times;
      RequestRetransmission(
          node_, channels::Keyframe(gap.map.agent_id),
          {gap.map, gap.from_seq, std::min(gap.to_seq, gap.from_seq + kMaxKeyframesAsked - 1)});
    }
  }
}

void PoseGraphProcess::RequestDueResults(int64_t now_utime) {
  if (now_utime < next_results_utime_) {
    return;
  }
  next_results_utime_ = now_utime + kSecond;
  std::map<MapId, ResultNames> overdue;
  for (auto& [id, due] : due_) {
    ResultNames& names =
        overdue.try_emplace(due.query.map, ResultNames{due.query.map, {}}).first->second;
    if (now_utime >= due.next_ask_utime && names.results.size() < ResultNames::kMax) {
      due.wait_us = std::min(2 * due.wait_us, kMaxResultAfter_us);
      due.next_ask_utime = now_utime + due.wait_us;
      names.results.emplace_back(due.query.seq, id);
    }
  }
  for (const auto& [map, names] : overdue) {
    if (!names.results.empty()) {
      RequestResults(node_, names);
    }
  }
}

void PoseGraphProcess::PublishStatus(int64_t now_utime) {
  const PoseGraph::Counters counters = graph_.counters();
  node_.Set("maps", counters.maps);
  node_.Set("groups", counters.groups);
  node_.Set("constraints_in_force", counters.in_force);
  node_.Set("constraints_switched_off", counters.switched_off);
  node_.Set("constraints_between_unmerged_maps", counters.unused);
  node_.Set("solves", counters.solves);
  node_.Set("edges_bridged", counters.bridged);
  node_.Set("odometry_sigma_percent", std::llround(100 * counters.odometry_scale));
  node_.Set("results_due", static_cast<int64_t>(due_.size()));
  if (!catching_up_to_.empty()) {
    return node_.PublishStatus(
        now_utime, num_to_catch_up_,
        fmt::format("catching up with the journal: {} to go", num_to_catch_up_));
  }
  node_.PublishStatus(
      now_utime,
      counters.parked + static_cast<int64_t>(keyframes_.parked()) +
          (num_finished_ != num_arrived_ ? 1 : 0),
      fmt::format("{} maps in {} groups, {} constraints in force, {} switched off", counters.maps,
                  counters.groups, counters.in_force, counters.switched_off));
}

}  // namespace pangea

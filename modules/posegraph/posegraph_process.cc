#include "posegraph/posegraph_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "bus/retransmission/timeouts.h"
#include "messages/channels.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr int64_t kSecond = 1'000'000;

}  // namespace

PoseGraphProcess::PoseGraphProcess(Bus& bus, const PoseGraphOptions& options,
                                   int64_t first_revision)
    : node_(bus, "posegraph"),
      graph_(options, first_revision),
      journal_(node_,
               {.in_order = true,
                .gives_up = true,
                .matches = JournalFollower::Which::kAll,
                .results = JournalFollower::Which::kAll},
               {.keyframe = std::bind_front(&PoseGraphProcess::OnKeyframe, this),
                .keyframe_came = [this](const KeyframeId& id) { graph_.NoteMap(id.map); },
                .match = std::bind_front(&PoseGraphProcess::OnPlaceMatch, this),
                .result = std::bind_front(&PoseGraphProcess::OnConstraint, this),
                .have = std::bind_front(&PoseGraphProcess::OnHave, this),
                .more_to_catch_up = [this] { return NumResultsToCatchUp(); },
                .handled = [this] { SettleUnlessMoreWaits(); }}) {
  node_.Listen<map_state_t>(channels::kRefinement,
                            std::bind_front(&PoseGraphProcess::OnRefinement, this));
  node_.Listen<resend_request_t>(channels::kResendRequest,
                                 std::bind_front(&PoseGraphProcess::OnResendRequest, this));
}

void PoseGraphProcess::OnKeyframe(const Keyframe& keyframe) {
  ++num_arrived_;
  graph_.Take(keyframe);
  ++num_unsettled_;
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
}

bool PoseGraphProcess::OnPlaceMatch(const PlaceMatch& match) {
  const KeyframeId& query = match.query;
  for (const PlaceCandidate& candidate : match.candidates) {
    Constraint promised;
    promised.from = candidate.match;
    promised.to = query;
    promised.kind = candidate.kind;
    if (!results_.contains(promised.Id()) && due_.size() < kMaxDue) {
      due_.try_emplace(promised.Id(),
                       Due{query, now_utime_ + timeouts::kResultWait_us, timeouts::kResultWait_us});
    }
  }
  return true;
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
  }
}

// Verification results of the journal that are still to come.
int64_t PoseGraphProcess::NumResultsToCatchUp() const {
  return std::ranges::count_if(due_, [this](const auto& item) {
    const Due& due = item.second;
    const auto goal = journal_.Goal(due.query.map);
    // Asked for twice by its name: the journal does not have it, it is still to be verified.
    return goal && due.query.seq <= *goal && due.wait_us < 4 * timeouts::kResultWait_us;
  });
}

void PoseGraphProcess::OnResendRequest(const ResendRequest& request) {
  if (request.channel == channels::kMapState) {
    graph_.Republish(request.range.map);
    ++num_unsettled_;
    SettleUnlessMoreWaits();
  }
}

void PoseGraphProcess::SettleUnlessMoreWaits() {
  if (num_unsettled_ > 0 && !journal_.catching_up() &&
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
  journal_.Tick(now_utime);
  SettleUnlessMoreWaits();
  RequestDueResults(now_utime);
  if (num_arrived_ != num_arrived_at_change_) {
    num_arrived_at_change_ = num_arrived_;
    last_change_utime_ = now_utime;
  } else if (num_finished_ != num_arrived_ && !journal_.catching_up() &&
             now_utime >= last_change_utime_ + kSecond) {
    num_finished_ = num_arrived_;
    Finish();
  }
  if (now_utime >= next_status_utime_) {
    next_status_utime_ = now_utime + kSecond;
    PublishStatus(now_utime);
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
      due.wait_us = std::min(2 * due.wait_us, timeouts::kMaxResultWait_us);
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
  if (journal_.catching_up()) {
    const int64_t to_go = journal_.num_to_catch_up();
    return node_.PublishStatus(now_utime, to_go,
                               fmt::format("catching up with the journal: {} to go", to_go));
  }
  node_.PublishStatus(
      now_utime,
      counters.parked + static_cast<int64_t>(journal_.parked()) +
          (num_finished_ != num_arrived_ ? 1 : 0),
      fmt::format("{} maps in {} groups, {} constraints in force, {} switched off", counters.maps,
                  counters.groups, counters.in_force, counters.switched_off));
}

}  // namespace pangea

#include "posegraph/posegraph_process.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <utility>

#include "messages/channels.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr uint32_t kCheckpointFormat = 7;
constexpr int64_t kSecond = 1'000'000;

// For people.
std::string NoteMoved(const std::set<TagId>& tags) {
  std::string note;
  for (const TagId& tag : tags) {
    note += note.empty() ? "; moved, and no longer trusted: tag " : ", ";
    note += ToString(tag);
  }
  return note;
}

}  // namespace

PoseGraphProcess::PoseGraphProcess(Bus& bus, const PoseGraphOptions& options,
                                   std::optional<int64_t> start_utime,
                                   const CheckpointPlace& checkpoint)
    : node_(bus, "posegraph"),
      graph_(options, start_utime),
      journal_(node_,
               {.in_order = true,
                .gives_up = true,
                .matches = JournalFollower::Which::kAll,
                .results = JournalFollower::Which::kAll},
               {.keyframe = std::bind_front(&PoseGraphProcess::OnKeyframe, this),
                .keyframe_came = [this](const KeyframeId& id) { graph_.AddMap(id.map); },
                .match =
                    [this](const PlaceMatch& match) {
                      results_.Promise(match, now_utime_);
                      return true;
                    },
                .result = std::bind_front(&PoseGraphProcess::OnConstraint, this),
                .have = std::bind_front(&PoseGraphProcess::OnHave, this),
                .more_to_catch_up = [this] { return results_.NumToCatchUp(journal_); },
                .handled = [this] { UpdateUnlessMoreWaits(); }},
               {.place = checkpoint,
                .format = kCheckpointFormat,
                .save = std::bind_front(&PoseGraphProcess::Save, this),
                .restore = std::bind_front(&PoseGraphProcess::Restore, this)}) {
  node_.Listen<map_state_t>(channels::kRefinement,
                            std::bind_front(&PoseGraphProcess::OnRefinement, this));
  node_.Listen<resend_request_t>(channels::kResendRequest,
                                 std::bind_front(&PoseGraphProcess::OnResendRequest, this));
}

void PoseGraphProcess::Save(ByteWriter* writer) {
  writer->Put(num_arrived_);
  results_.Save(writer);
  graph_.Save(writer);
}

bool PoseGraphProcess::Restore(ByteReader* reader) {
  int64_t num_arrived = 0;
  DueResults results;
  reader->Get(&num_arrived);
  results.Restore(reader, now_utime_);
  if (!graph_.Restore(reader)) {
    return false;
  }
  results_ = std::move(results);
  num_arrived_ = num_arrived;
  num_since_update_ = 1;
  return true;
}

void PoseGraphProcess::OnKeyframe(const Keyframe& keyframe) {
  ++num_arrived_;
  graph_.AddKeyframe(keyframe);
  ++num_since_update_;
}

void PoseGraphProcess::OnConstraint(const Constraint& constraint) {
  if (results_.MarkReceived(constraint.Id())) {
    ++num_arrived_;
    node_.Count(constraint.accepted ? "results_accepted" : "results_refused");
  } else {
    node_.Count("results_repeated");
  }
  graph_.AddConstraint(constraint);
  ++num_since_update_;
}

void PoseGraphProcess::OnRefinement(MapState state, const map_state_t& message) {
  const auto whole = refinements_.Add(message.chunk, message.num_chunks, std::move(state));
  if (whole) {
    node_.Count("refinements");
    graph_.AddRefinement(*whole);
    ++num_since_update_;
    UpdateUnlessMoreWaits();
  }
}

void PoseGraphProcess::OnHave(const Have& have) {
  for (const auto& [map, highest_seq] : have.highest_seq) {
    graph_.AddMap(map);
  }
}

void PoseGraphProcess::OnResendRequest(const ResendRequest& request) {
  if (request.channel == channels::kMapState) {
    graph_.Republish(request.range.map);
    ++num_since_update_;
    UpdateUnlessMoreWaits();
  }
}

void PoseGraphProcess::UpdateUnlessMoreWaits() {
  if (num_since_update_ > 0 && !journal_.catching_up() &&
      (num_since_update_ >= kMaxWithoutUpdate || !node_.bus().MoreWaits())) {
    num_since_update_ = 0;
    Publish(graph_.Update());
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
  num_since_update_ = 0;
  Publish(graph_.Finish());
}

void PoseGraphProcess::Tick(int64_t now_utime) {
  now_utime_ = now_utime;
  journal_.Tick(now_utime);
  UpdateUnlessMoreWaits();
  results_.RequestOverdue(node_, now_utime);
  if (num_arrived_ != num_arrived_at_change_) {
    num_arrived_at_change_ = num_arrived_;
    last_change_utime_ = now_utime;
  } else if (num_finished_ != num_arrived_ && !journal_.catching_up() &&
             now_utime >= last_change_utime_ + kSecond) {
    num_finished_ = num_arrived_;
    Finish();
  }
  if (node_.StatusIsDue(now_utime)) {
    PublishStatus(now_utime);
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
  node_.Set("maps_not_metric", counters.not_metric);
  node_.Set("odometry_sigma_percent", std::llround(100 * counters.odometry_scale));
  node_.Set("results_due", static_cast<int64_t>(results_.size()));
  if (journal_.catching_up()) {
    const int64_t to_go = journal_.num_to_catch_up();
    return node_.PublishStatus(now_utime, to_go,
                               fmt::format("catching up with the journal: {} to go", to_go));
  }
  node_.PublishStatus(
      now_utime,
      counters.waiting + static_cast<int64_t>(journal_.num_buffered()) +
          (num_finished_ != num_arrived_ ? 1 : 0),
      counters.maps == 0
          ? "no keyframes yet"
          : fmt::format("{} maps in {} groups, {} constraints in force, {} switched off{}",
                        counters.maps, counters.groups, counters.in_force, counters.switched_off,
                        NoteMoved(graph_.MovedTags())));
}

}  // namespace pangea

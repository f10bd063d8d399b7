#include "global_ba/global_ba_process.h"

#include <fmt/format.h>

#include <functional>
#include <utility>

#include "bus/record_status.h"
#include "messages/channels.h"
#include "messages/messages.h"

namespace pangea {
namespace {

constexpr uint32_t kCheckpointFormat = 3;
constexpr int64_t kSecond = 1'000'000;
// Longer than the time after which the pose graph solves everything from the beginning.
constexpr int64_t kQuiet_us = 3 * kSecond;

}  // namespace

GlobalBaProcess::GlobalBaProcess(Bus& bus, const GlobalBaOptions& options,
                                 const std::shared_ptr<RecordStore>& records,
                                 const CheckpointPlace& checkpoint)
    : node_(bus, "global_ba"),
      records_(std::make_shared<JournalRecords>(records, GlobalBa::RecordOf)),
      global_ba_(options, records_),
      journal_(node_,
               {.matches = JournalFollower::Which::kAll,
                .results = JournalFollower::Which::kAll,
                .states = true},
               {.keyframe = [this](Keyframe keyframe) { Take(std::move(keyframe)); },
                .match =
                    [this](const PlaceMatch& match) {
                      Take(match);
                      return true;
                    },
                .result = [this](const Constraint& result) { Take(result); }},
               {.place = checkpoint,
                .format = kCheckpointFormat,
                .save = std::bind_front(&GlobalBaProcess::Save, this),
                .restore = std::bind_front(&GlobalBaProcess::Restore, this)},
               records_) {
  node_.Listen<map_state_t>(channels::kMapState,
                            std::bind_front(&GlobalBaProcess::OnMapState, this));
  node_.Listen<resend_request_t>(channels::kResendRequest,
                                 std::bind_front(&GlobalBaProcess::OnResendRequest, this));
}

void GlobalBaProcess::Save(ByteWriter* writer) const {
  writer->Put(num_inputs_);
  global_ba_.Save(writer);
}

bool GlobalBaProcess::Restore(ByteReader* reader) {
  int64_t num_inputs = 0;
  reader->Get(&num_inputs);
  if (!global_ba_.Restore(reader)) {
    return false;
  }
  num_inputs_ = num_inputs;
  return true;
}

void GlobalBaProcess::OnMapState(MapState state, const map_state_t& message) {
  if (auto whole = chunks_.Add(message.chunk, message.num_chunks, std::move(state))) {
    journal_.NoteStates(whole->maps);
    global_ba_.Take(std::move(*whole));
  }
}

void GlobalBaProcess::OnResendRequest(const ResendRequest& request) {
  if (request.channel == channels::kMapState) {
    if (const MapState* const refined = global_ba_.RefinementOf(request.range.map)) {
      requested_.insert(refined->group);
    }
  }
}

void GlobalBaProcess::Advance() {
  if (const auto refined = global_ba_.Advance()) {
    Publish(*refined);
  }
}

void GlobalBaProcess::Publish(const MapState& refined) {
  for (const map_state_t& chunk : ToMessages(refined)) {
    node_.Publish(std::string(channels::kRefinement), chunk);
  }
}

void GlobalBaProcess::Finish() {
  while (global_ba_.HasWork()) {
    Advance();
  }
}

void GlobalBaProcess::Tick(int64_t now_utime) {
  journal_.Tick(now_utime);
  if (num_inputs_ != num_inputs_at_change_) {
    num_inputs_at_change_ = num_inputs_;
    last_input_utime_ = now_utime;
  }
  for (const MapId& group : std::exchange(requested_, {})) {
    if (const MapState* const refined = global_ba_.RefinementOf(group)) {
      Publish(*refined);
    }
  }
  if (node_.StatusIsDue(now_utime)) {
    PublishStatus(now_utime);
  }
  if (now_utime >= last_input_utime_ + kQuiet_us && !node_.bus().MoreWaits() &&
      global_ba_.HasWork()) {
    Advance();
  }
}

void GlobalBaProcess::PublishStatus(int64_t now_utime) {
  const GlobalBa::Counters& counters = global_ba_.counters();
  node_.Set("adjustments_begun", counters.begun);
  node_.Set("adjustments_dropped", counters.dropped);
  node_.Set("adjustments_finished", counters.finished);
  node_.PublishStatus(
      now_utime, global_ba_.HasWork() ? 1 : 0,
      fmt::format("{} keyframes, {} groups adjusted, {} adjustments dropped{}",
                  global_ba_.num_keyframes(), counters.finished, counters.dropped,
                  NoteRecords(global_ba_.store_counters(), records_.get(), &node_)));
}

}  // namespace pangea

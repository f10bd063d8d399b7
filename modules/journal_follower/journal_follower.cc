#include "journal_follower/journal_follower.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <stdexcept>
#include <utility>

#include "bus/retransmission/timeouts.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"

namespace pangea {

JournalFollower::JournalFollower(Node& node, const Follows& follows, Handlers handlers,
                                 JournalCheckpoint checkpoint,
                                 std::shared_ptr<JournalRecords> records)
    : node_(node),
      follows_(follows),
      handlers_(std::move(handlers)),
      checkpoint_(std::move(checkpoint)),
      records_(std::move(records)) {
  node_.Listen<KeyframeMessage>(channels::kAllKeyframes,
                                std::bind_front(&JournalFollower::OnKeyframe, this));
  if (follows_.matches == Which::kAll) {
    node_.Listen<place_match_t>(channels::kPlaceMatch,
                                std::bind_front(&JournalFollower::OnMatch, this));
  }
  if (follows_.results == Which::kAll) {
    node_.Listen<constraint_t>(channels::kConstraint,
                               std::bind_front(&JournalFollower::OnResult, this));
  }
  if (handlers_.anchor_edit) {
    node_.Listen<anchor_edit_t>(channels::kAnchorEdit, handlers_.anchor_edit);
  }
  node_.Listen<journal_file_t>(channels::kJournalFile,
                               std::bind_front(&JournalFollower::OnJournalFile, this));
  node_.Listen<have_t>(channels::kHave, std::bind_front(&JournalFollower::OnHave, this));
  node_.Subscribe<again_t>(
      channels::Again(node_.name()),
      [this](const std::string&, const again_t& again) { OnRetransmission(again); });
}

void JournalFollower::OnKeyframe(Keyframe keyframe) {
  if (handlers_.keyframe_came) {
    handlers_.keyframe_came(keyframe.id);
  }
  if (follows_.in_order) {
    AddInOrder(std::move(keyframe));
  } else {
    keyframes_.Add(keyframe.id.map, keyframe.id.seq, std::nullopt);
    HandOn({std::move(keyframe), event_});
  }
  Handled();
}

void JournalFollower::AddInOrder(Keyframe keyframe) {
  const KeyframeId id = keyframe.id;
  // If the edge begins further back, the keyframes in between are lost for good.
  if (keyframe.edge && keyframe.edge->from_seq < id.seq - 1) {
    Lose({id.map, keyframe.edge->from_seq + 1, id.seq - 1});
  }
  HandOn(keyframes_.Add(id.map, id.seq, Waiting{std::move(keyframe), event_}));
}

void JournalFollower::Lose(const SeqGap& gap) {
  const int32_t from_seq = std::max(gap.from_seq, keyframes_.next(gap.map));
  const bool credible =
      gap.to_seq - from_seq < static_cast<int32_t>(ReorderBuffer<Item>::kMaxBuffered);
  for (int32_t seq = from_seq; credible && seq <= gap.to_seq; ++seq) {
    HandOn(keyframes_.Add(gap.map, seq, std::nullopt));
  }
}

void JournalFollower::Skip(const SeqGap& gap) {
  const int32_t before = keyframes_.next(gap.map);
  std::vector<Item> ready = keyframes_.Skip(gap);
  const auto passed = keyframes_.next(gap.map) - before;
  if (follows_.in_order) {
    node_.NoteDropped(passed - static_cast<int64_t>(ready.size()));
    HandOn(std::move(ready));
  }
}

void JournalFollower::HandOn(std::vector<Item> ready) {
  for (Item& item : ready) {
    if (item) {
      HandOn(*std::move(item));
    } else {
      node_.NoteDropped();
    }
  }
}

void JournalFollower::HandOn(Waiting waiting) {
  if (records_ != nullptr) {
    records_->SetEvent(waiting.event);
  }
  handlers_.keyframe(std::move(waiting.keyframe));
  if (records_ != nullptr) {
    records_->SetEvent(std::nullopt);
  }
}

void JournalFollower::OnMatch(PlaceMatch match) {
  const KeyframeId query = match.query;
  if (handlers_.match(std::move(match)) && follows_.matches == Which::kAll) {
    matches_.Note(query.map, query.seq);
  }
  Handled();
}

void JournalFollower::OnResult(const Constraint& result) {
  handlers_.result(result);
  Handled();
}

void JournalFollower::OnHave(const Have& have) {
  have_received_ = true;
  if (handlers_.have) {
    handlers_.have(have);
  }
  if (reading()) {
    return;  // a later HAVE will say the same
  }
  for (const auto& [map, highest_seq] : have.highest_seq) {
    if (named_.insert(map).second) {
      TakeNewMap(map, highest_seq);
    }
    keyframes_.Announce(map, highest_seq);
  }
  for (const SeqGap& gap : have.gaps) {
    Skip(gap);
  }
  if (follows_.matches == Which::kAll) {
    matches_.Announce(have);
  }
  Handled();
}

void JournalFollower::TakeNewMap(const MapId& map, int32_t highest_seq) {
  // The journal has a map of which we have no keyframe: this process came late.
  if (keyframes_.next(map) == 0) {
    goal_[map] = highest_seq;
    keyframe_requests_.Expect(map);
    if (follows_.states) {
      states_.Announce(map);
    }
  }
  if (follows_.results != Which::kNone) {
    RequestAllRetransmissions(node_, std::string(channels::kConstraint), map, highest_seq);
  }
}

void JournalFollower::OnRetransmission(const again_t& again) {
  const bool known = TakeRetransmission<KeyframeMessage>(
                         node_, again, std::bind_front(&JournalFollower::OnKeyframe, this)) ||
                     (follows_.matches != Which::kNone &&
                      TakeRetransmission<place_match_t>(
                          node_, again, std::bind_front(&JournalFollower::OnMatch, this))) ||
                     (follows_.results != Which::kNone &&
                      TakeRetransmission<constraint_t>(
                          node_, again, std::bind_front(&JournalFollower::OnResult, this))) ||
                     (handlers_.anchor_edit &&
                      TakeRetransmission<anchor_edit_t>(node_, again, handlers_.anchor_edit));
  if (!known) {
    node_.Refuse("again: not what was asked for");
  }
}

void JournalFollower::Handled() {
  if (!goal_.empty() && NumMissing() == 0 && num_to_catch_up() == 0) {
    goal_.clear();
  }
  if (handlers_.handled) {
    handlers_.handled();
  }
}

// Only the first JOURNAL_FILE counts; events journalled after it come over the bus.
void JournalFollower::OnJournalFile(const JournalFile& file) {
  if (std::exchange(file_known_, true)) {
    return;
  }
  try {
    reader_ = std::make_unique<JournalReader>(file);
    if (records_ != nullptr) {
      records_->Open(file.path);
    }
  } catch (const std::runtime_error& error) {
    Log(node_.name(), fmt::format("the journal comes over the bus; its file here, {}: {}",
                                  file.path, error.what()));
    reader_.reset();
    return;
  }
  RestoreCheckpoint();
  reads_former_runs_ =
      follows_.matches == Which::kOfFormerRuns || follows_.results == Which::kOfFormerRuns;
  node_.WorkWhenIdle([this] { return ReadPiece(); });
}

// Returns whether some of the file is left.
bool JournalFollower::ReadPiece() {
  const auto take_of_former_runs = [this](const std::string& channel, Bytes data, int64_t) {
    TakeOfFormerRuns(channel, data);
    return true;
  };
  const JournalReader::Handler take = std::bind_front(&JournalFollower::TakeOfFile, this);
  try {
    if (reader_->Next(reads_former_runs_ ? take_of_former_runs : take)) {
      return true;
    }
    if (std::exchange(reads_former_runs_, false)) {
      reader_->Rewind();
      return true;
    }
    if (checkpoint_.place.writes) {
      WriteCheckpoint();
    }
  } catch (const JournalUnreadable& error) {
    if (checkpoint_.place.writes) {
      throw;
    }
    Log(node_.name(), fmt::format("the rest of the journal comes over the bus: {}", error.what()));
    named_.clear();  // so that the results of these maps are asked for
  }
  EndReading();
  return false;
}

void JournalFollower::EndReading() {
  reader_.reset();
  early_states_.clear();
  Handled();
}

template <typename Message, typename Handler>
void JournalFollower::TakeBytes(Bytes data, const Handler& handler) {
  Message message{};
  if (DecodeMessage(data, &message)) {
    node_.Take(message, handler);
  }
}

void JournalFollower::TakeOfFormerRuns(const std::string& channel, Bytes data) {
  if (channel == channels::kPlaceMatch && follows_.matches == Which::kOfFormerRuns) {
    TakeBytes<place_match_t>(data, std::bind_front(&JournalFollower::OnMatch, this));
  } else if (channel == channels::kConstraint && follows_.results == Which::kOfFormerRuns) {
    TakeBytes<constraint_t>(data, std::bind_front(&JournalFollower::OnResult, this));
  }
}

// Returns whether the event was taken. Not if a checkpoint is being made and must end before it.
bool JournalFollower::TakeOfFile(const std::string& channel, Bytes data, int64_t offset) {
  bool taken = true;
  if (channel.starts_with(channels::kKeyframePrefix)) {
    event_ = offset;
    TakeBytes<KeyframeMessage>(data, [&](Keyframe keyframe) {
      taken = !checkpoint_.place.writes || MayBeKept(keyframe);
      if (taken) {
        NoteMapOfFile(keyframe.id.map);
        OnKeyframe(std::move(keyframe));
      }
    });
    event_.reset();
  } else if (channel == channels::kPlaceMatch && follows_.matches == Which::kAll) {
    TakeBytes<place_match_t>(data, [&](PlaceMatch match) {
      taken = !checkpoint_.place.writes || !checkpoint_.match_is_complete ||
              checkpoint_.match_is_complete(match);
      if (taken) {
        OnMatch(std::move(match));
      }
    });
  } else if (channel == channels::kConstraint && follows_.results == Which::kAll) {
    TakeBytes<constraint_t>(data, std::bind_front(&JournalFollower::OnResult, this));
  } else if (channel == channels::kAnchorEdit && handlers_.anchor_edit) {
    TakeBytes<anchor_edit_t>(data, handlers_.anchor_edit);
  }
  return taken;
}

void JournalFollower::NoteStates(const std::vector<MapId>& maps) {
  states_.Note(maps);
  if (reading()) {  // the pose graph was faster than this process
    early_states_.insert(maps.begin(), maps.end());
  }
}

// The file has the map's keyframes and results, but not its place in the fused map.
void JournalFollower::NoteMapOfFile(const MapId& map) {
  if (named_.insert(map).second && follows_.states && !stopped_ && !early_states_.contains(map)) {
    states_.Announce(map);
  }
}

int64_t JournalFollower::NumMissing() const {
  int64_t count = 0;
  for (const auto& [map, seq] : goal_) {
    const bool lacks_matches = follows_.matches == Which::kAll && matches_.Lacks(map, seq);
    count += std::max(0, seq + 1 - keyframes_.next(map)) + (lacks_matches ? 1 : 0);
  }
  return count;
}

int64_t JournalFollower::num_to_catch_up() const {
  constexpr int64_t kKeyframeBytes = 30'000;
  const int64_t of_file = reading() ? 1 + reader_->bytes_left() / kKeyframeBytes : 0;
  return of_file + NumMissing() + (handlers_.more_to_catch_up ? handlers_.more_to_catch_up() : 0);
}

void JournalFollower::StopCatchingUp() {
  stopped_ = true;
  goal_.clear();
  states_.Forget();
}

std::optional<int32_t> JournalFollower::Goal(const MapId& map) const {
  const auto it = goal_.find(map);
  return it == goal_.end() ? std::nullopt : std::optional(it->second);
}

void JournalFollower::CatchUp(int64_t now_utime) {
  const int64_t count = num_to_catch_up();
  if (count < num_to_catch_up_ || num_to_catch_up_ == 0) {
    progress_utime_ = now_utime;
  }
  num_to_catch_up_ = count;
  if (count == 0 || now_utime >= progress_utime_ + timeouts::kCatchUpSilence_us) {
    goal_.clear();
    num_to_catch_up_ = 0;
  }
}

void JournalFollower::NoteReady(int64_t now_utime) {
  if (!ready_ && have_received_ && !catching_up()) {
    ready_ = true;
    node_.Set("ready_utime", now_utime);
  }
}

void JournalFollower::Tick(int64_t now_utime, bool ask_for_matches) {
  if (!goal_.empty()) {
    CatchUp(now_utime);
    Handled();
  }
  NoteReady(now_utime);
  if (reading()) {
    return;
  }
  AskForKeyframes(now_utime);
  if (ask_for_matches) {
    for (const SeqGap& gap : matches_.Due(now_utime)) {
      RequestRetransmission(node_, std::string(channels::kPlaceMatch), gap);
    }
  }
  for (const MapId& map : states_.Due(now_utime)) {
    AskForState(node_, map);
  }
}

void JournalFollower::AskForKeyframes(int64_t now_utime) {
  for (const SeqGap& gap : keyframe_requests_.Due(keyframes_.Gaps(), now_utime)) {
    if (follows_.gives_up && keyframe_requests_.Requests(gap.map) > timeouts::kMaxRequests) {
      Lose(gap);
      Handled();
      continue;
    }
    // Ask for the matches first, so that they are here when the keyframes come.
    if (follows_.matches == Which::kOfFormerRuns && catching_up()) {
      RequestRetransmission(node_, std::string(channels::kPlaceMatch), gap);
    }
    RequestRetransmission(node_, channels::Keyframe(gap.map.agent_id), gap);
  }
}

}  // namespace pangea

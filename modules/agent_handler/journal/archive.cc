#include "agent_handler/journal/archive.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <iostream>
#include <utility>

#include "bus/retransmission/missing.h"
#include "messages/anchor_messages.h"
#include "messages/catch_up_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/have_t.hpp"
#include "pangea/keyframe_2_t.hpp"
#include "pangea/keyframe_3_t.hpp"
#include "pangea/keyframe_4_t.hpp"

namespace pangea {
namespace {

// Everything that arrives within this time is written to the disk together.
constexpr int64_t kSyncInterval_us = 20'000;
// Rate of retransmissions to the server's processes.
constexpr double kResendBytesPerS = 6e6;
constexpr double kResendBurst = 64'000;
constexpr size_t kMaxJournalledBytes = 65'000;
constexpr size_t kMaxProcesses = 100;
constexpr size_t kMaxHaveMaps = 1500;  // maps and gaps together take about 45 kB
constexpr size_t kMaxHaveGaps = 1000;
// How long agents may fill gaps after damage. An uplink gives up a gap that its odometry does not
// fill within ten seconds.
constexpr int64_t kAskForGaps_us = 30'000'000;

// Whether data that Parse refuses are damaged: they have this type's fingerprint but do not decode,
// or have no fingerprint. Data of a type that this version does not know are not damaged.
template <typename Message>
bool IsDamaged(Bytes data) {
  Message message{};
  if (DecodeMessage(data, &message) || data.size() < 8) {
    return data.size() < 8;
  }
  const std::vector<uint8_t> fresh = EncodeMessage(Message{});
  const bool same_type = std::equal(fresh.begin(), fresh.begin() + 8, data.begin());
  const bool zeros = std::all_of(data.begin(), data.begin() + 8, [](uint8_t b) { return b == 0; });
  return same_type || zeros;
}

seq_gap_t ToMessage(const SeqGap& gap) {
  seq_gap_t message{};
  message.map = pangea::ToMessage(gap.map);
  message.from_seq = gap.from_seq;
  message.to_seq = gap.to_seq;
  return message;
}

}  // namespace

Archive::Archive(Node& node, const std::string& journal_path, int64_t now_utime, bool replicated,
                 const std::function<void()>& before_mend)
    : node_(node),
      anchor_edits_(node),
      resend_pacer_(kResendBytesPerS, kResendBurst),
      now_utime_(now_utime) {
  journal_ = std::make_unique<Journal>(journal_path, std::bind_front(&Archive::LoadEvent, this),
                                       before_mend);
  replication_.emplace(replicated, journal_->size());
  const JournalMend& mend = journal_->mend();
  node_.Set("journal_bytes_torn", mend.torn_bytes);
  node_.Set("journal_bytes_damaged", mend.damaged_bytes);
  asks_for_gaps_until_utime_ = mend.damaged_bytes > 0 ? now_utime + kAskForGaps_us : now_utime;
  if (const std::string said = mend.Said(journal_path); !said.empty()) {
    std::cerr << said << "\n";
  }
  node_.bus().Subscribe(
      std::string(channels::kPlaceMatch),
      [this](const std::string& channel, Bytes data) { OnAnswer<place_match_t>(channel, data); });
  node_.bus().Subscribe(
      std::string(channels::kConstraint),
      [this](const std::string& channel, Bytes data) { OnAnswer<constraint_t>(channel, data); });
  node_.bus().Subscribe(
      std::string(channels::kAllOptions),
      [this](const std::string& channel, Bytes data) { OnOptions(channel, data); });
  node_.Subscribe<resend_request_t>(
      std::string(channels::kResendRequest),
      [this](const std::string&, const resend_request_t& message) { OnResendRequest(message); });
  node_.Listen<verdict_request_t>(channels::kVerificationRequest,
                                  std::bind_front(&Archive::OnVerificationRequest, this));
  node_.Listen<journal_file_t>(channels::kJournalFile,
                               std::bind_front(&Archive::OnJournalFile, this));
  node_.Listen<journal_file_t>(channels::kJournalReplicated, [this](const JournalFile& file) {
    replication_->OnReplicated(file.state.num_bytes, now_us_);
  });
  node_.Subscribe<again_t>(
      channels::Again(node_.name()),
      [this](const std::string&, const again_t& message) { OnRetransmission(message); });
}

void Archive::OnResendRequest(const resend_request_t& message) {
  if (message.requester == node_.name()) {
    return;
  }
  const std::string reason = message.channel == channels::kAnchorEdit
                                 ? anchor_edits_.OnResendRequest(message)
                                 : resend_queue_.Add(message, index_);
  if (!reason.empty()) {
    node_.Refuse(reason);
  }
}

void Archive::OnVerificationRequest(const VerificationRequest& request) {
  if (request.requester != node_.name() && !resend_queue_.Add(request, index_)) {
    node_.Refuse("too many resend requests are waiting");
  }
}

void Archive::OnRetransmission(const again_t& message) {
  if (message.channel == channels::kPlaceMatch) {
    OnAnswer<place_match_t>(message.channel, message.data);
  } else if (message.channel == channels::kConstraint) {
    OnAnswer<constraint_t>(message.channel, message.data);
  }
}

// A process repeats its options every few seconds; `utime` is the time of its start.
void Archive::OnOptions(const std::string& channel, Bytes data) {
  auto options = ParseMessage<options_t>(data);
  if (!options.value) {
    return node_.Refuse(options.refused);
  }
  if (!options_in_force_.contains(options.value->process) &&
      options_in_force_.size() >= kMaxProcesses) {
    return node_.Refuse("options of too many processes");
  }
  ProcessOptions& known = options_in_force_[options.value->process];
  if (options.value->utime <= known.utime || journal_->Full()) {
    return;
  }
  if (options.value->yaml != known.yaml) {
    journal_->Append(now_utime_, channel, data);
  }
  known = *std::move(options.value);
}

void Archive::NoteJournalled(const KeyframeId& id) {
  const auto [highest, is_new] = have_.try_emplace(id.map, id.seq);
  highest->second = std::max(highest->second, id.seq);
  if (is_new) {
    by_age_.push_back(id.map);
  }
}

std::optional<Keyframe> Archive::Newest(const MapId& map) const {
  const auto places = index_.Find(JournalChannel::kKeyframe, {map, have_.at(map)});
  return places.empty() ? std::nullopt
                        : ParseMessage<KeyframeMessage>(journal_->Read(places.front())).value;
}

bool Archive::LoadEvent(const std::string& channel, Bytes data, const JournalPlace& place) {
  if (channel.starts_with(channels::kKeyframePrefix)) {
    if (const auto keyframe = ParseMessage<KeyframeMessage>(data); keyframe.value) {
      const KeyframeId& id = keyframe.value->id;
      index_.AddKeyframe(id, place);
      NoteJournalled(id);
      return true;
    }
    node_.Count("journal_events_unreadable");
    return !IsDamaged<keyframe_t>(data) && !IsDamaged<keyframe_2_t>(data) &&
           !IsDamaged<keyframe_3_t>(data) && !IsDamaged<keyframe_4_t>(data);
  }
  if (channel == channels::kPlaceMatch) {
    return LoadAnswer<place_match_t>(data, place);
  }
  if (channel.starts_with(channels::kOptionsPrefix)) {
    return LoadOptions(data);
  }
  if (channel == channels::kAnchorEdit) {
    return LoadAnchorEdit(data, place);
  }
  return channel != channels::kConstraint || LoadAnswer<constraint_t>(data, place);
}

bool Archive::LoadAnchorEdit(Bytes data, const JournalPlace& place) {
  if (anchor_edits_.Load(data, place)) {
    return true;
  }
  node_.Count("journal_events_unreadable");
  return !IsDamaged<anchor_edit_t>(data);
}

bool Archive::LoadOptions(Bytes data) {
  auto options = ParseMessage<options_t>(data);
  if (!options.value) {
    node_.Count("journal_events_unreadable");
    return !IsDamaged<options_t>(data);
  }
  // Any start after this one is newer, also by a clock that went back meanwhile.
  options.value->utime = 0;
  options_in_force_[options.value->process] = *std::move(options.value);
  return true;
}

template <typename Message>
bool Archive::LoadAnswer(Bytes data, const JournalPlace& place) {
  const auto answer = ParseMessage<Message>(data);
  if (!answer.value) {
    node_.Count("journal_events_unreadable");
    return !IsDamaged<Message>(data);
  }
  if (index_.Check(*answer.value) == JournalIndex::Added::kNew) {
    index_.Add(*answer.value, place);
  }
  return true;
}

AnchorEdits::Taken Archive::Append(AnchorEdit edit) {
  if (!journal_->HasUnsynced()) {
    oldest_unsynced_us_ = now_us_;
  }
  return anchor_edits_.Take(std::move(edit), now_utime_, journal_.get());
}

void Archive::Append(const KeyframeId& id, std::vector<uint8_t> bytes) {
  if (unsynced_.empty()) {
    oldest_unsynced_us_ = now_us_;
  }
  const JournalPlace place =
      journal_->Append(now_utime_, channels::Keyframe(id.map.agent_id), bytes);
  unsynced_.push_back({id, std::move(bytes), place});
}

bool Archive::MayJoin(int32_t agent_id) const {
  return !replication_->Awaits(agent_id) &&
         std::ranges::none_of(unsynced_, [agent_id](const Unsynced& keyframe) {
           return keyframe.id.map.agent_id == agent_id;
         });
}

void Archive::WriteDue() {
  if (!journal_->HasUnsynced() || now_us_ - oldest_unsynced_us_ < kSyncInterval_us) {
    return;
  }
  oldest_unsynced_us_ = now_us_;
  disk_refuses_ = !journal_->Sync();
  if (disk_refuses_) {
    return node_.Count("journal_writes_failed");
  }
  Replication::Group group{journal_->size(), {}, anchor_edits_.num_edits()};
  for (const Unsynced& keyframe : unsynced_) {
    index_.AddKeyframe(keyframe.id, keyframe.place);
    NoteJournalled(keyframe.id);
    group.keyframes.push_back(keyframe.id);
    node_.bus().Publish(channels::Keyframe(keyframe.id.map.agent_id), keyframe.bytes);
  }
  unsynced_.clear();
  replication_->Add(std::move(group));
  if (replication_->wanted()) {
    PublishJournalFile();
  }
}

std::vector<KeyframeId> Archive::Sync() {
  WriteDue();
  std::vector<KeyframeId> kept;
  for (const Replication::Group& group : replication_->TakeKept()) {
    kept.insert(kept.end(), group.keyframes.begin(), group.keyframes.end());
    anchor_edits_.OnKept(group.num_edits);
  }
  return kept;
}

template <typename Message>
void Archive::OnAnswer(const std::string& channel, Bytes data) {
  const auto answer = ParseMessage<Message>(data);
  if (!answer.value) {
    return node_.Refuse(answer.refused);
  }
  if (data.size() > kMaxJournalledBytes) {
    return node_.Refuse(channel + " is too large");
  }
  const JournalIndex::Added added = index_.Check(*answer.value);
  if (added == JournalIndex::Added::kUnknownKeyframe) {
    return node_.Refuse(channel + " of a keyframe that is not journalled");
  }
  if (added == JournalIndex::Added::kNew && !journal_->Full()) {
    index_.Add(*answer.value, journal_->Append(now_utime_, channel, data));
  }
}

void Archive::AnswerResendRequests() {
  // This also bounds the work of one call when keyframes have no messages to send.
  constexpr int kMaxKeyframes = 200;
  resend_pacer_.Refill(now_us_);
  for (int64_t bytes = 1; resend_pacer_.Ready() && bytes > 0;) {
    bytes = anchor_edits_.AnswerNext(*journal_);
    resend_pacer_.Take(bytes);
  }
  for (int i = 0; i < kMaxKeyframes && resend_pacer_.Ready(); ++i) {
    const auto answer = resend_queue_.Next(index_);
    if (!answer) {
      return;
    }
    for (const JournalPlace& place : answer->places) {
      again_t again{};
      again.channel = answer->channel;
      again.data = journal_->Read(place);
      again.num_bytes = static_cast<int32_t>(again.data.size());
      if (again.data.empty()) {
        node_.Count("journal_reads_failed");
        continue;
      }
      node_.Publish(channels::Again(answer->requester), again);
      node_.Count("retransmitted");
      resend_pacer_.Take(again.num_bytes);
    }
  }
}

std::vector<SeqGap> Archive::Refillable(const MapId& map) const {
  return journal_->mend().damaged_bytes > 0 ? index_.Gaps(map) : std::vector<SeqGap>{};
}

// The gaps that HAVE calls lost. Processes skip these keyframes, so for some time after damage none
// is called lost: its agent may still send it again.
std::vector<SeqGap> Archive::Lost(const MapId& map) const {
  return now_utime_ < asks_for_gaps_until_utime_ ? std::vector<SeqGap>{} : index_.Gaps(map);
}

std::string Archive::Damage() const {
  const JournalMend& mend = journal_->mend();
  return mend.damaged_bytes == 0
             ? ""
             : fmt::format("; THE JOURNAL WAS DAMAGED: {} bytes, kept beside it",
                           mend.damaged_bytes);
}

void Archive::PublishJournalFile() {
  node_.Publish(std::string(channels::kJournalFile),
                ToMessage(JournalFile{JournalPath(), journal_->state()}));
}

// The processes of two servers on one bus take each other's keyframes, matches and corrections.
void Archive::OnJournalFile(const JournalFile& file) {
  if (file.path != JournalPath()) {
    node_.Refuse(
        fmt::format("another server is on this bus, with the journal {}: give each server "
                    "a --bus of its own",
                    file.path));
  }
}

std::string Archive::JournalPath() const {
  return std::filesystem::absolute(journal_->path()).string();
}

void Archive::PublishHave() {
  PublishJournalFile();
  auto it = by_age_.begin();
  size_t told = 0;  // gaps of this map; a thinned journal has many
  do {
    have_t message{};
    for (; it != by_age_.end() && message.maps.size() < kMaxHaveMaps; ++it, told = 0) {
      message.maps.push_back(ToMessage(*it));
      message.highest_seq.push_back(have_.at(*it));
      const std::vector<SeqGap> lost = Lost(*it);
      for (; told < lost.size() && message.gaps.size() < kMaxHaveGaps; ++told) {
        message.gaps.push_back(ToMessage(lost[told]));
      }
      if (told < lost.size()) {
        break;  // the next message continues with this map
      }
    }
    message.num_maps = static_cast<int16_t>(message.maps.size());
    message.num_gaps = static_cast<int16_t>(message.gaps.size());
    node_.Publish(std::string(channels::kHave), message);
  } while (it != by_age_.end());
  anchor_edits_.PublishNewest();
}

void Archive::RequestOutstanding() {
  const OutstandingResults::Requests requests = outstanding_.Due(index_, now_utime_);
  for (const SeqGap& gap : requests.matches) {
    RequestRetransmission(node_, std::string(channels::kPlaceMatch), gap);
  }
  for (const ResultNames& names : requests.results) {
    RequestResults(node_, names);
  }
}

void Archive::SetCounters() {
  node_.Set("journal_bytes", journal_->size());
  node_.Set("journal_keyframes", index_.num_keyframes());
  node_.Set("journal_matches", index_.num_matches());
  node_.Set("journal_constraints", index_.num_constraints());
  node_.Set("journal_anchor_edits", anchor_edits_.num_edits());
  node_.Set("results_missing", index_.num_missing_results());
}

}  // namespace pangea

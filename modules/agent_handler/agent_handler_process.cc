#include "agent_handler/agent_handler_process.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/channels.h"
#include "pangea/again_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/pose_t.hpp"

namespace pangea {
namespace {

constexpr int64_t kSecond_us = 1'000'000;
constexpr double kResendBurst = 64'000;
constexpr size_t kMaxJournalledBytes = 65'000;
constexpr size_t kMaxCorrections = 1000;
constexpr int kBusy_ms = 4;
constexpr int kIdle_ms = 20;
constexpr size_t kMaxHaveMaps = 1500;  // with the gaps about 45 kB
constexpr size_t kMaxHaveGaps = 1000;

// Unreadable though it says it is of this type (or has lost even that): damaged. A type this
// version does not know is left alone.
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

template <typename Message>
auto DecodeAndParse(Bytes data) -> decltype(Parse(Message{})) {
  Message message{};
  if (!DecodeMessage(data, &message)) {
    return {std::nullopt, std::string(Message::getTypeName()) + " does not decode"};
  }
  return Parse(message);
}

}  // namespace

AgentHandlerProcess::AgentHandlerProcess(Bus& link_bus, Bus& server_bus,
                                         const std::string& journal_path,
                                         const std::string& key_folder, int64_t now_utime,
                                         const AgentHandlerOptions& options)
    : link_bus_(link_bus),
      key_folder_(key_folder),
      options_(options),
      node_(server_bus, "agent_handler"),
      resend_pacer_(options.resend_bytes_per_s, kResendBurst),
      now_utime_(now_utime) {
  ReadKeys();
  journal_ = std::make_unique<Journal>(
      journal_path, [this](const std::string& channel, Bytes data, const JournalPlace& place) {
        return LoadEvent(channel, data, place);
      });
  for (const MapId& map : by_age_) {
    missing_corrections_.Announce(map);
  }
  node_.Set("journal_bytes_cut", journal_->cut_bytes());
  link_bus.Subscribe("LINK_UP_[0-9]+",
                     [this](const std::string& channel, Bytes data) { OnLinkUp(channel, data); });
  server_bus.Subscribe(
      std::string(channels::kPlaceMatch),
      [this](const std::string& channel, Bytes data) { OnAnswer<place_match_t>(channel, data); });
  server_bus.Subscribe(
      std::string(channels::kConstraint),
      [this](const std::string& channel, Bytes data) { OnAnswer<constraint_t>(channel, data); });
  node_.Subscribe<correction_t>(std::string(channels::kAllCorrections),
                                [this](const std::string&, const correction_t& message) {
                                  const auto correction = Parse(message);
                                  if (!correction.value) {
                                    return node_.Refuse(correction.refused);
                                  }
                                  OnCorrection(*correction.value);
                                });
  node_.Subscribe<landmarks_t>(
      std::string(channels::kAllLandmarks),
      [this](const std::string&, const landmarks_t& message) { OnLandmarks(message); });
  node_.Subscribe<resend_request_t>(std::string(channels::kResendRequest),
                                    [this](const std::string&, const resend_request_t& request) {
                                      if (request.requester == node_.name()) {
                                        return;
                                      }
                                      const std::string reason = resend_queue_.Add(request, index_);
                                      if (!reason.empty()) {
                                        node_.Refuse(reason);
                                      }
                                    });
  node_.Subscribe<again_t>(channels::Again(node_.name()),
                           [this](const std::string&, const again_t& again) {
                             if (again.channel == channels::kPlaceMatch) {
                               OnAnswer<place_match_t>(again.channel, again.data);
                             } else if (again.channel == channels::kConstraint) {
                               OnAnswer<constraint_t>(again.channel, again.data);
                             }
                           });
}

void AgentHandlerProcess::NoteJournalled(const KeyframeId& id) {
  const auto [highest, is_new] = have_.try_emplace(id.map, id.seq);
  highest->second = std::max(highest->second, id.seq);
  if (is_new) {
    by_age_.push_back(id.map);
  }
}

bool AgentHandlerProcess::LoadEvent(const std::string& channel, Bytes data,
                                    const JournalPlace& place) {
  if (channel.starts_with("KEYFRAME_")) {
    if (const auto keyframe = DecodeAndParse<keyframe_t>(data); keyframe.value) {
      const KeyframeId& id = keyframe.value->id;
      index_.AddKeyframe(id, place);
      NoteJournalled(id);
      return true;
    }
    node_.Count("journal_events_unreadable");
    return !IsDamaged<keyframe_t>(data);
  }
  if (channel == channels::kPlaceMatch) {
    return LoadAnswer<place_match_t>(data, place);
  }
  return channel != channels::kConstraint || LoadAnswer<constraint_t>(data, place);
}

template <typename Message>
bool AgentHandlerProcess::LoadAnswer(Bytes data, const JournalPlace& place) {
  const auto answer = DecodeAndParse<Message>(data);
  if (!answer.value) {
    node_.Count("journal_events_unreadable");
    return !IsDamaged<Message>(data);
  }
  if (index_.Look(*answer.value) == JournalIndex::Added::kNew) {
    index_.Add(*answer.value, place);
  }
  return true;
}

void AgentHandlerProcess::OnCorrection(const Correction& correction) {
  // Kept for an agent whose hello is still to come: after a restart, it is.
  missing_corrections_.Note({correction.map});
  Correction& newest = corrections_[correction.map];
  if (newest.revision < correction.revision) {
    newest = correction;
  }
  if (corrections_.size() > kMaxCorrections) {
    corrections_.erase(corrections_.begin());
  }
  const auto agent = agents_.find(correction.map.agent_id);
  if (agent != agents_.end() && agent->second.handler) {
    agent->second.handler->OnCorrection(correction);
  }
}

// Best effort: an agent that is away misses them.
void AgentHandlerProcess::OnLandmarks(const landmarks_t& message) {
  const auto landmarks = Parse(message);
  if (!landmarks.value || message.getEncodedSize() > kMaxLandmarksBytes) {
    return node_.Refuse(landmarks.value ? "landmarks: too large" : landmarks.refused);
  }
  const int32_t agent_id = landmarks.value->map.agent_id;
  const auto agent = agents_.find(agent_id);
  if (agent != agents_.end() && agent->second.session.HasUplink()) {
    SendDown(agent_id, &agent->second,
             agent->second.session.Seal(LinkKind::kLandmarks, EncodeMessage(message)));
  }
}

// An agent whose key has gone is shut out; what it sent stays. One whose key has changed begins a
// new session.
void AgentHandlerProcess::ReadKeys() {
  const std::map<int32_t, SecretKey> keys = key_folder_.Read();
  if (keys.size() > kMaxAgents) {
    throw std::runtime_error(
        fmt::format("{} keys: one server takes {} agents at most", keys.size(), kMaxAgents));
  }
  std::erase_if(agents_, [&](const auto& item) { return !keys.contains(item.first); });
  for (const auto& [agent_id, key] : keys) {
    const auto agent = agents_.find(agent_id);
    if (agent == agents_.end()) {
      agents_.emplace(agent_id, Agent{HandlerSession(agent_id, key), std::nullopt});
    } else if (!(agent->second.session.agent_key() == key)) {
      agent->second.session = HandlerSession(agent_id, key);
    }
  }
}

AgentHandler AgentHandlerProcess::MakeHandler(int32_t agent_id) const {
  AgentHandler handler(agent_id, options_.receiver);
  for (auto have = have_.lower_bound({agent_id, 0});
       have != have_.end() && have->first.agent_id == agent_id; ++have) {
    handler.Resume(have->first, have->second);
  }
  for (const auto& [map, correction] : corrections_) {
    if (map.agent_id == agent_id) {
      handler.OnCorrection(correction);
    }
  }
  return handler;
}

void AgentHandlerProcess::SendDown(int32_t agent_id, Agent* agent, Bytes packet) {
  const std::string channel = channels::LinkDown(agent_id);
  link_bus_.Publish(channel, packet);
  agent->bytes_down += BytesOnTheWire(channel, packet);
}

void AgentHandlerProcess::OnLinkUp(const std::string& channel, Bytes data) {
  const auto found = agents_.find(channels::LinkUpAgent(channel).value_or(0));
  if (found == agents_.end()) {
    return node_.Refuse("packet of an agent without a key");
  }
  const int32_t agent_id = found->first;
  Agent& agent = found->second;
  const HandlerSession::Opened opened = agent.session.Open(data);
  if (!opened.refused.empty()) {
    return node_.Refuse(opened.refused);
  }
  agent.bytes_up += BytesOnTheWire(channel, data);
  if (!opened.welcome.empty()) {
    SendDown(agent_id, &agent, opened.welcome);
  }
  if (!opened.packet) {
    return;
  }
  ++agent.packets;
  if (!agent.handler) {
    agent.handler.emplace(MakeHandler(agent_id));
  }
  if (opened.new_uplink) {
    agent.handler->OnNewUplink();
  }
  const std::string reason = agent.handler->OnPacket(*opened.packet);
  if (!reason.empty()) {
    node_.Refuse(reason);
  }
  if (const auto pose = agent.handler->TakePose()) {
    node_.Publish(channels::Pose(agent_id), *pose);
  }
  JournalReady();
}

void AgentHandlerProcess::JournalReady() {
  for (auto& [agent_id, agent] : agents_) {
    if (journal_->Full()) {
      return;  // it stays in the receive cache
    }
    if (!agent.handler) {
      continue;
    }
    for (Receiver::Keyframe& keyframe : agent.handler->TakeReady()) {
      if (unsynced_.empty()) {
        oldest_unsynced_us_ = now_us_;
      }
      const JournalPlace place =
          journal_->Append(now_utime_, channels::Keyframe(agent_id), keyframe.bytes);
      unsynced_.push_back({keyframe.id, std::move(keyframe.bytes), place});
    }
  }
}

void AgentHandlerProcess::SyncJournal() {
  if (!journal_->HasUnsynced() || now_us_ - oldest_unsynced_us_ < options_.sync_interval_us) {
    return;
  }
  oldest_unsynced_us_ = now_us_;
  disk_refuses_ = !journal_->Sync();
  if (disk_refuses_) {
    return node_.Count("journal_writes_failed");
  }
  for (const Unsynced& keyframe : unsynced_) {
    index_.AddKeyframe(keyframe.id, keyframe.place);
    NoteJournalled(keyframe.id);
    const auto agent = agents_.find(keyframe.id.map.agent_id);
    if (agent != agents_.end() && agent->second.handler) {
      ++agent->second.keyframes;
      agent->second.handler->Journalled(keyframe.id);
    }
    node_.bus().Publish(channels::Keyframe(keyframe.id.map.agent_id), keyframe.bytes);
  }
  unsynced_.clear();
}

template <typename Message>
void AgentHandlerProcess::OnAnswer(const std::string& channel, Bytes data) {
  const auto answer = DecodeAndParse<Message>(data);
  if (!answer.value) {
    return node_.Refuse(answer.refused);
  }
  if (data.size() > kMaxJournalledBytes) {
    return node_.Refuse(channel + " is too large");
  }
  const JournalIndex::Added added = index_.Look(*answer.value);
  if (added == JournalIndex::Added::kUnknownKeyframe) {
    return node_.Refuse(channel + " of a keyframe that is not journalled");
  }
  if (added == JournalIndex::Added::kNew && !journal_->Full()) {
    index_.Add(*answer.value, journal_->Append(now_utime_, channel, data));
  }
}

void AgentHandlerProcess::SendAcks() {
  for (auto& [agent_id, agent] : agents_) {
    const auto ack = agent.handler ? agent.handler->TakeAck(now_us_) : std::nullopt;
    if (ack && agent.session.HasUplink()) {
      SendDown(agent_id, &agent, agent.session.Seal(LinkKind::kAck, Encode(*ack)));
    }
  }
}

void AgentHandlerProcess::AnswerResendRequests() {
  // Also bounds the work of one call when keyframes have no match or verdict to send.
  constexpr int kMaxKeyframes = 200;
  resend_pacer_.Refill(now_us_);
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
      node_.Count("sent_again");
      resend_pacer_.Take(again.num_bytes);
    }
  }
}

int AgentHandlerProcess::Poll(int64_t steady_us) {
  now_us_ = steady_us;
  JournalReady();
  SyncJournal();
  SendAcks();
  AnswerResendRequests();
  const bool busy = journal_->HasUnsynced() || resend_queue_.waiting() > 0 ||
                    std::any_of(agents_.begin(), agents_.end(), [](const auto& item) {
                      return item.second.handler && item.second.handler->receiver().pending() > 0;
                    });
  return busy ? kBusy_ms : kIdle_ms;
}

void AgentHandlerProcess::PublishHave() {
  auto it = by_age_.begin();
  do {
    have_t message{};
    for (; it != by_age_.end() && message.maps.size() < kMaxHaveMaps; ++it) {
      message.maps.push_back(ToMessage(*it));
      message.highest_seq.push_back(have_.at(*it));
      for (const SeqGap& gap : index_.Gaps(*it)) {
        if (message.gaps.size() < kMaxHaveGaps) {
          message.gaps.push_back(ToMessage(gap));
        }
      }
    }
    message.num_maps = static_cast<int16_t>(message.maps.size());
    message.num_gaps = static_cast<int16_t>(message.gaps.size());
    node_.Publish(std::string(channels::kHave), message);
  } while (it != by_age_.end());
}

void AgentHandlerProcess::AskForOwed(int64_t now_utime) {
  for (const auto& [channel, gap] : owed_.Due(index_, now_utime)) {
    resend_request_t request{};
    request.requester = node_.name();
    request.channel =
        channel == JournalChannel::kPlaceMatch ? channels::kPlaceMatch : channels::kConstraint;
    request.map = ToMessage(gap.map);
    request.from_seq = gap.from_seq;
    request.to_seq = gap.to_seq;
    node_.Publish(std::string(channels::kResendRequest), request);
    node_.NoteResendAsked();
  }
}

void AgentHandlerProcess::LookForKeys() {
  try {
    if (key_folder_.Changed()) {
      ReadKeys();
    }
  } catch (const std::exception& error) {
    node_.Refuse(error.what());  // the keys stay as they were
  }
}

void AgentHandlerProcess::PublishStatus(int64_t now_utime) {
  int64_t pending = 0, given_up = 0, keyframes = 0, connected = 0;
  for (const auto& [agent_id, agent] : agents_) {
    if (!agent.handler) {
      continue;
    }
    ++connected;
    pending += static_cast<int64_t>(agent.handler->receiver().pending());
    given_up += agent.handler->receiver().given_up();
    keyframes += agent.keyframes;
    node_.Set(fmt::format("keyframes_{}", agent_id), agent.keyframes);
    node_.Set(fmt::format("packets_{}", agent_id), agent.packets);
    node_.Set(fmt::format("bytes_up_{}", agent_id), agent.bytes_up);
    node_.Set(fmt::format("bytes_down_{}", agent_id), agent.bytes_down);
  }
  node_.Set("agents", connected);
  node_.Set("agents_with_key", static_cast<int64_t>(agents_.size()));
  node_.Set("keyframes", keyframes);
  node_.Set("keyframes_given_up", given_up);
  node_.Set("journal_bytes", journal_->size());
  node_.Set("journal_keyframes", index_.num_keyframes());
  node_.Set("journal_matches", index_.num_matches());
  node_.Set("journal_constraints", index_.num_constraints());
  node_.Set("verdicts_missing", index_.num_missing_verdicts());
  node_.PublishStatus(
      now_utime, pending,
      fmt::format("{} agents, {} keyframes in the journal{}", connected, index_.num_keyframes(),
                  disk_refuses_ ? "; THE DISK REFUSES WRITES" : ""));
}

void AgentHandlerProcess::Tick(int64_t now_utime) {
  now_utime_ = now_utime;
  if (now_utime >= next_have_utime_) {
    next_have_utime_ = now_utime + kSecond_us;
    LookForKeys();
    PublishHave();
    AskForOwed(now_utime);
    for (const MapId& map : missing_corrections_.Due(now_utime)) {
      AskForState(node_, map);
    }
  }
  if (now_utime >= next_status_utime_) {
    next_status_utime_ = now_utime + kSecond_us;
    PublishStatus(now_utime);
  }
}

}  // namespace pangea

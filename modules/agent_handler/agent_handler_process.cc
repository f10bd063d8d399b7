#include "agent_handler/agent_handler_process.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

#include "bus/status_log.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/pose_t.hpp"

namespace pangea {
namespace {

constexpr int64_t kSecond_us = 1'000'000;
constexpr size_t kMaxCorrections = 16 * AgentHandlerProcess::kMaxAgents;
// If this many hellos in a row are refused, the reason is another key and not damage on the way.
constexpr int kManyHellos = 3;
// After this time without a hello the uplink counts as away: it sends one every second.
constexpr int64_t kAway_us = 3 * kSecond_us;
constexpr size_t kMaxStrangers = 10;
// Waits for the next Poll. A message ends them, so of an idle link only repeats matter.
constexpr int kBusy_ms = 4;
constexpr int kAck_ms = 20;
constexpr int kIdle_ms = 100;

}  // namespace

AgentHandlerProcess::AgentHandlerProcess(Bus& link_bus, Bus& server_bus,
                                         const std::string& journal_path,
                                         const std::string& key_folder, int64_t now_utime,
                                         const AgentHandlerOptions& options,
                                         const std::function<void()>& before_mend)
    : link_bus_(link_bus),
      key_folder_name_(key_folder),
      key_folder_(key_folder),
      options_(options),
      node_(server_bus, "agent_handler"),
      archive_(node_, journal_path, now_utime, options.replicated, before_mend),
      anchors_(node_, archive_) {
  node_.Watch(link_bus);
  ReadKeys();
  for (const MapId& map : archive_.maps()) {
    missing_corrections_.Announce(map);
  }
  link_bus.Subscribe(std::string(channels::kAllLinkUps),
                     [this](const std::string& channel, Bytes data) { OnLinkUp(channel, data); });
  node_.Listen<correction_t>(channels::kAllCorrections,
                             std::bind_front(&AgentHandlerProcess::OnCorrection, this));
  node_.Listen<landmarks_t>(channels::kAllLandmarks,
                            std::bind_front(&AgentHandlerProcess::OnLandmarks, this));
  node_.Listen<others_t>(channels::kAllOthers,
                         std::bind_front(&AgentHandlerProcess::OnOthers, this));
}

void AgentHandlerProcess::OnCorrection(const Correction& correction) {
  // Also kept for an agent whose hello has not come yet, as after a restart.
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

void AgentHandlerProcess::OnLandmarks(const MapLandmarks& landmarks, const landmarks_t& message) {
  if (message.getEncodedSize() > kMaxLandmarksBytes) {
    return node_.Refuse("landmarks: too large");
  }
  SendBestEffort(landmarks.map.agent_id, LinkKind::kLandmarks, EncodeMessage(message));
}

void AgentHandlerProcess::OnOthers(const Others& others, const others_t& message) {
  SendBestEffort(others.map.agent_id, LinkKind::kOthers, EncodeMessage(message));
}

bool AgentHandlerProcess::IsThere(const Agent& agent) const {
  return agent.session.HasUplink() && now_us_ - agent.heard_us < kAway_us;
}

// The packet is sent once; an agent that is away does not get it.
void AgentHandlerProcess::SendBestEffort(int32_t agent_id, LinkKind kind,
                                         std::vector<uint8_t> body) {
  const auto agent = agents_.find(agent_id);
  if (agent != agents_.end() && IsThere(agent->second)) {
    SendDown(agent_id, &agent->second, agent->second.session.Seal(kind, std::move(body)));
  }
}

// An agent whose key was removed is shut out; its keyframes stay in the journal. An agent whose key
// has changed begins a new session.
void AgentHandlerProcess::ReadKeys() {
  const std::map<int32_t, AgentKey> keys = key_folder_.Read();
  for (const std::string& file : key_folder_.unusable()) {
    node_.Refuse(file);
  }
  if (keys.size() > kMaxAgents) {
    throw std::runtime_error(
        fmt::format("folder of keys {}: it has {}, and one server takes {} agents at most: take "
                    "some out",
                    key_folder_name_, keys.size(), kMaxAgents));
  }
  std::erase_if(agents_, [&](const auto& item) { return !keys.contains(item.first); });
  std::map<int32_t, AnchorRight> rights;
  for (const auto& [agent_id, read] : keys) {
    rights[agent_id] = read.anchors;
    const auto agent = agents_.find(agent_id);
    if (agent == agents_.end()) {
      agents_.emplace(agent_id, Agent{HandlerSession(agent_id, read.key), std::nullopt});
    } else if (!(agent->second.session.agent_key() == read.key)) {
      agent->second.session = HandlerSession(agent_id, read.key);
    }
  }
  anchors_.SetRights(rights);
}

AgentHandler AgentHandlerProcess::MakeHandler(int32_t agent_id) const {
  AgentHandler handler(agent_id, options_.receiver);
  // The newest maps come first. Only as many are read from the disk as a hello can name.
  const auto& on_disk = archive_.have();
  auto have = std::make_reverse_iterator(on_disk.lower_bound({agent_id + 1, 0}));
  for (int i = 0; have != on_disk.rend() && have->first.agent_id == agent_id; ++have, ++i) {
    handler.Resume(have->first, have->second, archive_.Refillable(have->first),
                   i < kMaxLinkMaps ? archive_.Newest(have->first) : std::nullopt);
  }
  for (const auto& [map, correction] : corrections_) {
    if (map.agent_id == agent_id) {
      handler.OnCorrection(correction);
    }
  }
  return handler;
}

int64_t AgentHandlerProcess::SendDown(int32_t agent_id, Agent* agent, Bytes packet) {
  const std::string channel = channels::LinkDown(agent_id);
  link_bus_.Publish(channel, packet);
  const int64_t bytes = BytesOnTheWire(channel, packet);
  agent->bytes_down += bytes;
  return bytes;
}

void AgentHandlerProcess::OnLinkUp(const std::string& channel, Bytes data) {
  if (!archive_.MayAnswer()) {
    return node_.Count("packets_not_taken");
  }
  const auto found = agents_.find(channels::AgentOf(channel, channels::kLinkUpPrefix));
  if (found == agents_.end()) {
    return RefuseStranger(channels::AgentOf(channel, channels::kLinkUpPrefix));
  }
  const int32_t agent_id = found->first;
  Agent& agent = found->second;
  const HandlerSession::Opened opened = agent.session.Open(data);
  if (!opened.refused.empty()) {
    if (opened.refused == kHelloNotOpened && ++agent.hellos_refused == kManyHellos) {
      TellOnce(agent_id, fmt::format("is refused: it has another key than the server's {}/{}",
                                     key_folder_name_, KeyFileName(agent_id)));
    }
    return node_.Refuse(opened.refused);
  }
  agent.hellos_refused = 0;
  agent.bytes_up += BytesOnTheWire(channel, data);
  if (!opened.welcome.empty()) {
    SendDown(agent_id, &agent, opened.welcome);
  }
  if (opened.packet) {
    ++agent.packets;
    agent.heard_us = now_us_;
    agent.new_uplink = agent.new_uplink || opened.new_uplink;
    if (HasJoined(agent_id, &agent)) {
      TakePacket(agent_id, &agent, opened);
    }
  }
}

// Anyone can send as any agent, so only a few are named: a node tells a limited number of reasons.
void AgentHandlerProcess::RefuseStranger(int32_t agent_id) {
  if (strangers_.size() < kMaxStrangers && strangers_.insert(agent_id).second) {
    TellOnce(agent_id, fmt::format("is refused: the folder of keys, {}, has no key for it",
                                   key_folder_name_));
  }
  const std::string who =
      strangers_.contains(agent_id) ? fmt::format("agent {},", agent_id) : "an agent";
  node_.Refuse("packet of " + who + " whose key is not in the folder of keys");
}

void AgentHandlerProcess::TellOnce(int32_t agent_id, const std::string& what) {
  if (told_.emplace(agent_id, what).second) {
    Log(node_.name(), fmt::format("agent {} {}", agent_id, what));
  }
}

// Lets the agent join if it has not yet.
bool AgentHandlerProcess::HasJoined(int32_t agent_id, Agent* agent) {
  if (agent->handler) {
    return true;
  }
  if (!archive_.MayJoin(agent_id)) {
    return false;  // else it would be told of keyframes that are not kept, or send some twice
  }
  agent->handler.emplace(MakeHandler(agent_id));
  Log(node_.name(), fmt::format("agent {} has joined", agent_id));
  return true;
}

void AgentHandlerProcess::TakePacket(int32_t agent_id, Agent* agent,
                                     const HandlerSession::Opened& opened) {
  if (opened.two_uplinks) {
    TellOnce(agent_id, "has two uplinks: end one, or give it an id and a key of its own");
    node_.Refuse(fmt::format(
        "two uplinks run as agent {}: end one, or give it an id and a key of its own", agent_id));
  }
  if (std::exchange(agent->new_uplink, false)) {
    agent->handler->OnNewUplink();
    anchors_.OnNewSession(agent_id);
  }
  const std::string reason = AnchorRelay::IsOfAnchors(opened.packet->kind)
                                 ? anchors_.OnPacket(agent_id, *opened.packet)
                                 : agent->handler->OnPacket(*opened.packet);
  if (!reason.empty()) {
    node_.Refuse(reason);
  }
  if (const auto pose = agent->handler->TakePose()) {
    node_.Publish(channels::Pose(agent_id), *pose);
  }
  JournalReady(agent);
}

void AgentHandlerProcess::JournalReady(Agent* agent) {
  if (archive_.Full() || !agent->handler) {
    return;  // keyframes that are ready stay in the receive cache
  }
  for (Receiver::Keyframe& keyframe : agent->handler->TakeReady()) {
    archive_.Append(keyframe.id, std::move(keyframe.bytes));
  }
}

void AgentHandlerProcess::SendAcks() {
  for (auto& [agent_id, agent] : agents_) {
    const bool answers = agent.handler && IsThere(agent);
    if (const auto ack = answers ? agent.handler->TakeAck(now_us_) : std::nullopt) {
      SendDown(agent_id, &agent, agent.session.Seal(LinkKind::kAck, Encode(*ack)));
    }
  }
}

void AgentHandlerProcess::SendAnchors() {
  for (auto& entry : agents_) {
    const auto agent_id = entry.first;
    auto& agent = entry.second;
    if (IsThere(agent)) {
      anchors_.SendDue(agent_id, now_us_, [&](LinkKind kind, std::vector<uint8_t> body) {
        return SendDown(agent_id, &agent, agent.session.Seal(kind, std::move(body)));
      });
    }
  }
}

int AgentHandlerProcess::Poll(int64_t steady_us) {
  now_us_ = steady_us;
  archive_.set_now_us(steady_us);
  for (auto& [agent_id, agent] : agents_) {
    JournalReady(&agent);
  }
  anchors_.Poll();
  for (const KeyframeId& id : archive_.Sync()) {
    const auto agent = agents_.find(id.map.agent_id);
    if (agent != agents_.end() && agent->second.handler) {
      if (++agent->second.keyframes == 1) {
        TellOnce(id.map.agent_id, "sends keyframes: the first is in the journal");
      }
      agent->second.handler->Journalled(id);
    }
  }
  anchors_.OnJournalled(archive_.TakeJournalledEdits());
  if (archive_.MayAnswer()) {
    SendAcks();
    SendAnchors();
  }
  archive_.AnswerResendRequests();
  const auto any_agent = [this](const auto& holds) {
    return std::any_of(agents_.begin(), agents_.end(), [&holds](const auto& item) {
      return item.second.handler && holds(*item.second.handler);
    });
  };
  if (archive_.busy() ||
      any_agent([](const AgentHandler& one) { return one.receiver().pending() > 0; })) {
    return kBusy_ms;
  }
  return any_agent([](const AgentHandler& one) { return one.OwesAck(); }) ? kAck_ms : kIdle_ms;
}

void AgentHandlerProcess::LookForKeys() {
  try {
    if (key_folder_.Changed()) {
      ReadKeys();
    }
  } catch (const std::exception& error) {
    node_.Refuse(error.what());
    // All other keys stay valid, but an agent whose own key file was removed is shut out.
    std::erase_if(agents_, [&](const auto& item) { return key_folder_.IsGone(item.first); });
  }
}

std::string AgentHandlerProcess::OtherSoftware() const {
  std::string others;
  for (const auto& [agent_id, agent] : agents_) {
    if (agent.handler && agent.handler->software() != OurSoftware()) {
      others += fmt::format("; agent {} runs {}, not {}", agent_id, agent.handler->software(),
                            OurSoftware());
    }
  }
  return others;
}

std::string AgentHandlerProcess::OtherKeys() const {
  std::string others;
  for (const auto& [agent_id, agent] : agents_) {
    if (agent.hellos_refused >= kManyHellos) {
      others += fmt::format("; hellos of agent {} do not open: its key is not the one here, {}",
                            agent_id, KeyFileName(agent_id));
    }
  }
  return others;
}

std::string AgentHandlerProcess::UnusableKeys() const {
  const auto& files = key_folder_.unusable();
  return files.empty()
             ? ""
             : fmt::format("; {} of the key files cannot be used: {}", files.size(), files.front());
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
  archive_.SetCounters();
  anchors_.SetCounters();
  node_.PublishStatus(
      now_utime, pending,
      fmt::format("{} agents, {} keyframes in the journal{}{}{}{}{}{}{}", connected,
                  archive_.num_keyframes(),
                  archive_.MayAnswer() ? ""
                                       : "; NO AGENT IS ANSWERED: no bridge to NATS says that "
                                         "the journal is replicated",
                  agents_.empty() ? "; the folder of keys is empty: nobody can join" : "",
                  archive_.disk_refuses() ? "; THE DISK REFUSES WRITES" : "", archive_.Damage(),
                  UnusableKeys(), OtherSoftware(), OtherKeys()));
}

void AgentHandlerProcess::Tick(int64_t now_utime) {
  archive_.set_now_utime(now_utime);
  if (next_have_utime_ == 0) {
    node_.Set("ready_utime", now_utime);
  }
  if (now_utime >= next_have_utime_) {
    next_have_utime_ = now_utime + kSecond_us;
    LookForKeys();
    archive_.PublishHave();
    archive_.RequestOutstanding();
    for (const MapId& map : missing_corrections_.Due(now_utime)) {
      AskForState(node_, map);
    }
  }
  if (node_.StatusIsDue(now_utime)) {
    PublishStatus(now_utime);
  }
}

}  // namespace pangea

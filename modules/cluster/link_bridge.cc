#include "cluster/link_bridge.h"

#include <fmt/format.h>

#include <functional>
#include <string_view>

#include "cluster/site_streams.h"
#include "link/link_session.h"
#include "messages/channels.h"

namespace pangea {
namespace {

// While packets come, the next one from NATS must not wait.
constexpr int64_t kActive_us = 1'000'000;
constexpr int kActiveWait_ms = 5, kIdleWait_ms = 50;

}  // namespace

bool RecentPackets::Add(Bytes packet) {
  const size_t hash =
      std::hash<std::string_view>{}({reinterpret_cast<const char*>(packet.data()), packet.size()});
  if (!known_.insert(hash).second) {
    return false;
  }
  hashes_.push_back(hash);
  if (hashes_.size() > kKept) {
    known_.erase(hashes_.front());
    hashes_.pop_front();
  }
  return true;
}

LinkBridge::LinkBridge(Bus& link_bus, NatsClient& nats, const std::string& site, End end)
    : link_bus_(link_bus),
      nats_(nats),
      site_(CheckedSite(site)),
      end_(end),
      heard_prefix_(SubjectOf(end == End::kEdge ? "down" : "up", "")),
      heard_subject_(heard_prefix_ + "*") {
  nats_.Listen(heard_subject_);
  link_bus.Subscribe(
      std::string(end == End::kEdge ? channels::kAllLinkUps : channels::kAllLinkDowns),
      [this](const std::string& channel, Bytes packet) { OnPacket(channel, packet); });
}

std::string LinkBridge::SubjectOf(const char* direction, const std::string& agent) const {
  return fmt::format("pangea.{}.link.{}.{}", site_, direction, agent);
}

bool LinkBridge::IsWanted(int32_t agent_id) const {
  const auto heard = heard_utime_.find(agent_id);
  return end_ == End::kEdge ||
         (heard != heard_utime_.end() && now_utime_ - heard->second < kAway_us);
}

void LinkBridge::OnPacket(const std::string& channel, Bytes packet) {
  const bool edge = end_ == End::kEdge;
  const int32_t agent_id =
      channels::AgentOf(channel, edge ? channels::kLinkUpPrefix : channels::kLinkDownPrefix);
  if (agent_id == 0 || packet.size() > kMaxLinkPacketBytes || !IsWanted(agent_id)) {
    return;
  }
  // On a common link bus, each end would take what the other one published, without end.
  if (!recent_.Add(packet)) {
    ++counters_.echoes;
    return;
  }
  active_utime_ = now_utime_;
  ++counters_.from_bus;
  nats_.Publish(SubjectOf(edge ? "up" : "down", std::to_string(agent_id)), packet);
}

void LinkBridge::BetweenMessages(int64_t now_utime) {
  now_utime_ = now_utime;
  while (const auto heard = nats_.NextHeard(heard_subject_)) {
    const int32_t agent_id = channels::AgentOf(heard->subject, heard_prefix_);
    if (agent_id == 0 || heard->data.size() > kMaxLinkPacketBytes) {
      continue;
    }
    active_utime_ = now_utime;
    ++counters_.from_nats;
    if (end_ == End::kServer) {
      heard_utime_[agent_id] = now_utime;
    }
    link_bus_.Publish(
        end_ == End::kEdge ? channels::LinkDown(agent_id) : channels::LinkUp(agent_id),
        heard->data);
  }
}

int LinkBridge::longest_wait_ms() const {
  return now_utime_ - active_utime_ < kActive_us ? kActiveWait_ms : kIdleWait_ms;
}

std::string LinkBridge::State() const {
  if (!nats_.connected()) {
    return "NATS DOES NOT ANSWER";
  }
  if (counters_.echoes > 0) {
    return fmt::format(
        "{} packets came back: the edge and the server are on one link bus; give the edge another "
        "(--bus)",
        counters_.echoes);
  }
  return fmt::format("{} packets from the link bus, {} from NATS", counters_.from_bus,
                     counters_.from_nats);
}

void LinkBridge::Tick(int64_t now_utime) {
  if (const auto line = changes_.Take(now_utime, State())) {
    Log("pangea-bridge", *line);
  }
}

}  // namespace pangea

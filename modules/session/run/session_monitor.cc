#include "session/run/session_monitor.h"

#include <poll.h>

#include <algorithm>
#include <set>

#include "bus/node.h"
#include "bus/process.h"
#include "messages/catch_up_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/messages.h"
#include "pangea/pose_t.hpp"

namespace pangea::session {
namespace {

constexpr int64_t kStatusFresh_us = 3'000'000;

void NoteTime(int64_t utime, AgentProgress* progress) {
  if (progress->first_utime == 0) {
    progress->first_utime = utime;
  }
  progress->newest_utime = std::max(progress->newest_utime, utime);
}

}  // namespace

SessionMonitor::SessionMonitor(const Buses& buses) : last_work_(WallUtime()) {
  buses_.push_back(std::make_unique<LcmBus>(buses.server));
  WatchServer(*buses_.back());
  for (const auto& [id, url] : buses.agents) {
    agents_[id];
    buses_.push_back(std::make_unique<LcmBus>(url));
    agent_buses_[id] = buses_.back().get();
    WatchAgent(id, *buses_.back());
  }
}

SessionMonitor::~SessionMonitor() = default;

void SessionMonitor::WatchServer(Bus& bus) {
  const auto note_work = [this](const std::string&, Bytes) { last_work_ = WallUtime(); };
  bus.Subscribe(std::string(channels::kAllKeyframes), note_work);
  bus.Subscribe(std::string(channels::kPlaceMatch), note_work);
  bus.Subscribe(channels::Again(".*"), note_work);
  bus.Subscribe(std::string(channels::kConstraint), [this](const std::string&, Bytes data) {
    last_work_ = WallUtime();
    constraint_t message;
    if (DecodeMessage(data, &message)) {
      ++(message.accepted != 0 ? accepted_ : refused_);
    }
  });
  bus.Subscribe(std::string(channels::kMapState), [this](const std::string&, Bytes data) {
    last_work_ = WallUtime();
    OnMapState(data);
  });
  for (const auto& [id, progress] : agents_) {
    bus.Subscribe(channels::Correction(id),
                  [this, id = id](const std::string&, Bytes data) { OnCorrection(id, data); });
  }
  bus.Subscribe(std::string(channels::kAllStatus),
                [this](const std::string&, Bytes data) { OnStatus(data); });
}

void SessionMonitor::WatchAgent(int32_t id, Bus& bus) {
  bus.Subscribe(channels::Pose(id),
                [this, id](const std::string&, Bytes data) { OnPose(id, data); });
  bus.Subscribe(channels::Keyframe(id),
                [this, id](const std::string&, Bytes data) { OnKeyframe(id, data); });
  bus.Subscribe(channels::Correction(id),
                [this, id](const std::string&, Bytes data) { OnCorrection(id, data); });
  bus.Subscribe(std::string(channels::kHave),
                [this](const std::string&, Bytes data) { OnHave(data); });
  bus.Subscribe(std::string(channels::kAllStatus),
                [this](const std::string&, Bytes data) { OnStatus(data); });
}

void SessionMonitor::OnMapState(Bytes data) {
  const auto state = ParseMessage<map_state_t>(data);
  if (!state.value) {
    return;
  }
  groups_.Take({state.value->revision, state.value->maps});
  for (auto& [id, progress] : agents_) {
    std::set<int32_t> others;
    for (const auto& [map, group] : groups_.by_map()) {
      if (map.agent_id == id && groups_.IsCurrent(*group)) {
        for (const MapId& other : group->maps) {
          others.insert(other.agent_id);
        }
      }
    }
    others.erase(id);
    progress.fused_with.assign(others.begin(), others.end());
  }
}

void SessionMonitor::OnCorrection(int32_t agent_id, Bytes data) {
  const auto correction = ParseMessage<correction_t>(data);
  if (!correction.value) {
    return;
  }
  Drift& drift = drifts_[correction.value->map];
  const auto pose = poses_.find(agent_id);
  if (drift.Take(*correction.value) && pose != poses_.end() &&
      pose->second.map == correction.value->map) {
    agents_[agent_id].drift_m = drift.Moved(pose->second.T_odom_body.t);
  }
}

void SessionMonitor::NotePose(int32_t agent_id, const map_id_t& map, const rigid3_t& T_odom_body) {
  const auto parsed_map = Parse(map);
  const auto parsed_T = Parse(T_odom_body);
  if (!parsed_map.value || !parsed_T.value) {
    return;
  }
  const auto [pose, is_first] = poses_.try_emplace(agent_id);
  if (pose->second.map != *parsed_map.value) {
    agents_[agent_id].drift_m = 0;  // no correction of the new map has come yet
  }
  pose->second = {*parsed_map.value, *parsed_T.value};
}

void SessionMonitor::OnPose(int32_t agent_id, Bytes data) {
  pose_t message;
  if (!DecodeMessage(data, &message)) {
    return;
  }
  AgentProgress& progress = agents_[agent_id];
  with_odometry_.insert(agent_id);
  NoteTime(message.utime, &progress);
  progress.tracking = message.state == pose_t::STATE_TRACKING;
  progress.reason = message.reason;
  if (progress.tracking) {
    NotePose(agent_id, message.map, message.T_odom_body);
  }
}

void SessionMonitor::OnKeyframe(int32_t agent_id, Bytes data) {
  KeyframeMessage message;
  const auto id = DecodeMessage(data, &message) ? Parse(message.id).value : std::nullopt;
  if (!id || id->map.agent_id != agent_id) {
    return;
  }
  int32_t& published = published_[id->map];
  published = std::max(published, id->seq + 1);
  if (with_odometry_.contains(agent_id)) {
    return;
  }
  // Stored keyframes are played without poses between them.
  AgentProgress& progress = agents_[agent_id];
  NoteTime(message.utime, &progress);
  progress.tracking = true;
  NotePose(agent_id, message.id.map, message.T_odom_body);
}

void SessionMonitor::OnHave(Bytes data) {
  if (const auto have = ParseMessage<have_t>(data).value) {
    for (const auto& [map, highest_seq] : have->highest_seq) {
      int32_t& acknowledged = acknowledged_[map];
      acknowledged = std::max(acknowledged, highest_seq + 1);
    }
  }
}

void SessionMonitor::OnStatus(Bytes data) {
  status_t message;
  if (!DecodeMessage(data, &message)) {
    return;
  }
  for (auto& [id, progress] : agents_) {
    if (message.process == "vio_" + std::to_string(id) ||
        message.process == "keyframes_" + std::to_string(id)) {
      progress.keyframes = CounterOf(message, "keyframes").value_or(0);
    }
  }
  status_received_[message.process] = WallUtime();
  status_t& status = statuses_[message.process];
  if (message.cpu_s < status.cpu_s) {  // it was started again
    cpu_before_s_[message.process] += static_cast<double>(status.cpu_s);
  }
  status = std::move(message);
}

void SessionMonitor::Handle(int timeout_ms) {
  std::vector<pollfd> fds;
  for (const auto& bus : buses_) {
    fds.push_back({bus->fd(), POLLIN, 0});
  }
  if (poll(fds.data(), fds.size(), timeout_ms) <= 0) {
    return;
  }
  for (size_t i = 0; i < fds.size(); ++i) {
    // Bounded, so that a flood on one bus cannot block the session.
    for (int n = 0; n < 200 && (fds[i].revents & POLLIN) != 0 && buses_[i]->Handle(0); ++n) {
    }
  }
}

const AgentProgress& SessionMonitor::agent(int32_t id) const { return agents_.at(id); }

std::map<std::string, double> SessionMonitor::CpuSeconds() const {
  std::map<std::string, double> cpu_s = cpu_before_s_;
  for (const auto& [name, status] : statuses_) {
    cpu_s[name] += static_cast<double>(status.cpu_s);
  }
  return cpu_s;
}

double SessionMonitor::QuietSeconds() const {
  return 1e-6 * static_cast<double>(WallUtime() - last_work_);
}

bool SessionMonitor::HaveReported(const std::vector<std::string>& processes) const {
  return std::ranges::all_of(processes,
                             [&](const std::string& name) { return statuses_.contains(name); });
}

int64_t SessionMonitor::Unacknowledged(int32_t id) const {
  int64_t count = 0;
  for (const auto& [map, published] : published_) {
    const auto acknowledged = acknowledged_.find(map);
    if (map.agent_id == id) {
      count +=
          std::max(0, published - (acknowledged == acknowledged_.end() ? 0 : acknowledged->second));
    }
  }
  return count;
}

void SessionMonitor::ForgetPublished(int32_t id) {
  std::erase_if(published_, [id](const auto& item) { return item.first.agent_id == id; });
}

bool SessionMonitor::Idle(const std::vector<std::string>& processes, double quiet_s) const {
  const int64_t now = WallUtime();
  return QuietSeconds() > quiet_s &&
         std::all_of(processes.begin(), processes.end(), [&](const std::string& name) {
           const auto status = statuses_.find(name);
           return status != statuses_.end() && status->second.pending == 0 &&
                  now - status_received_.at(name) < kStatusFresh_us;
         });
}

}  // namespace pangea::session

#include "link_emulator/link_emulator_process.h"

#include <fmt/format.h>

#include <algorithm>

#include "messages/channels.h"

namespace pangea {
namespace {

constexpr int kIdle_ms = 20;

}  // namespace

LinkEmulatorProcess::LinkEmulatorProcess(Bus& agent_link, Bus& server_link, Bus& status_bus,
                                         int32_t agent_id, const LinkConditions& conditions,
                                         int64_t steady_us)
    : conditions_(Describe(conditions)),
      begin_us_(steady_us),
      node_(status_bus, fmt::format("link_emulator_{}", agent_id)),
      up_{{conditions, LinkDirection::kUp}, server_link, channels::LinkUp(agent_id), "up", {}},
      down_{{conditions, LinkDirection::kDown},
            agent_link,
            channels::LinkDown(agent_id),
            "down",
            {}} {
  node_.Watch(agent_link);
  node_.Watch(server_link);
  Relay(agent_link, &up_);
  Relay(server_link, &down_);
}

void LinkEmulatorProcess::Relay(Bus& from, Way* way) {
  from.Subscribe(way->channel, [way](const std::string&, Bytes packet) {
    way->arrived.emplace_back(packet.begin(), packet.end());
  });
}

int LinkEmulatorProcess::Poll(int64_t steady_us) {
  const int64_t now_us = steady_us - begin_us_;
  int64_t wait_us = int64_t{1000} * kIdle_ms;
  for (Way* way : {&up_, &down_}) {
    for (const std::vector<uint8_t>& packet : way->arrived) {
      way->emulator.Add(now_us, packet);
    }
    way->arrived.clear();
    for (const LinkEmulator::Delivery& delivery : way->emulator.TakeDue(now_us)) {
      way->to.Publish(way->channel, delivery.packet);
    }
    if (const auto next = way->emulator.next_due_us()) {
      wait_us = std::min(wait_us, *next - now_us);
    }
  }
  return static_cast<int>((wait_us + 999) / 1000);
}

void LinkEmulatorProcess::Count(const Way& way) {
  const LinkEmulator::Counts& counts = way.emulator.counts();
  node_.Set(way.name + "_taken", counts.taken);
  node_.Set(way.name + "_delivered", counts.delivered);
  node_.Set(way.name + "_lost", counts.lost);
  node_.Set(way.name + "_cut", counts.cut);
  node_.Set(way.name + "_overflowed", counts.overflowed);
  node_.Set(way.name + "_doubled", counts.doubled);
  node_.Set(way.name + "_reordered", counts.reordered);
}

void LinkEmulatorProcess::Tick(int64_t now_utime) {
  if (!node_.StatusIsDue(now_utime)) {
    return;
  }
  Count(up_);
  Count(down_);
  const auto pending = static_cast<int64_t>(up_.emulator.under_way() + down_.emulator.under_way());
  node_.PublishStatus(
      now_utime, pending,
      fmt::format("{}: {} of {} packets delivered up, {} of {} down", conditions_,
                  up_.emulator.counts().delivered, up_.emulator.counts().taken,
                  down_.emulator.counts().delivered, down_.emulator.counts().taken));
}

}  // namespace pangea

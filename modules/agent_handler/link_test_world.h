#pragma once

// For tests: an uplink and an agent_handler on in-process buses, with an odometry, and a lossy link
// between them.

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "agent_handler/agent_handler_process.h"
#include "bus/bus.h"
#include "uplink/edit_spool.h"
#include "uplink/uplink_process.h"

namespace pangea {

inline constexpr int64_t kSecond = 1'000'000;
inline const MapId kMap{1, 1000};

// Loses messages, doubles them, and holds them back until others have overtaken them.
class LossyBus : public Bus {
 public:
  void Publish(const std::string& channel, Bytes data) override;
  void Subscribe(const std::string& channel_regex, Handler handler) override {
    inner.Subscribe(channel_regex, std::move(handler));
  }
  LocalBus inner;
  double loss = 0;
  double doubled = 0;
  double held = 0;

 private:
  double Unit() { return std::uniform_real_distribution<double>(0, 1)(rng_); }
  std::mt19937_64 rng_{3};
  std::vector<std::pair<std::string, std::vector<uint8_t>>> held_;  // at most kMaxHeld
  static constexpr size_t kMaxHeld = 10;
};

// Stands between a bus and a process: after Off, the bus no longer reaches the process. This
// replaces fresh buses at each restart of a process.
class SwitchedBus : public Bus {
 public:
  explicit SwitchedBus(Bus& bus) : bus_(bus) {}
  void Publish(const std::string& channel, Bytes data) override;
  void Subscribe(const std::string& channel_regex, Handler handler) override;
  void Off() { *on_ = false; }

 private:
  Bus& bus_;
  std::shared_ptr<bool> on_ = std::make_shared<bool>(true);
};

class LinkWorld : public testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  std::filesystem::path KeyFile(int32_t agent_id) const {
    return folder / "keys" / KeyFileName(agent_id);
  }
  // Writes the agent's key file with this right. The handler uses it from its next look at the
  // keys.
  void SetAnchorRight(const std::string& word) const;
  void StartUplink();
  void KillUplink();
  void StartHandler();
  void KillHandler();
  void PublishKeyframes(int count);
  void Run(double seconds);
  // Expects that keyframes 0 to count - 1 were delivered in order, byte for byte.
  void ExpectDelivered(int count) const;

  static constexpr int64_t kWall = 1'700'000'000 * kSecond;
  LocalBus agent_bus, server_bus;
  LossyBus link_bus;
  UplinkOptions options;
  AgentHandlerOptions handler_options;
  std::filesystem::path folder;  // journal and keys
  std::string journal_path;
  std::vector<std::unique_ptr<SwitchedBus>> dead_buses;
  std::vector<std::unique_ptr<UplinkProcess>> dead_uplinks;
  std::unique_ptr<SwitchedBus> uplink_agent_side, uplink_link_side;
  std::unique_ptr<SwitchedBus> handler_link_side, handler_server_side;
  bool spools_edits = false;
  std::vector<std::unique_ptr<EditSpool>> edit_spools;  // one for each uplink
  std::unique_ptr<UplinkProcess> uplink;
  std::unique_ptr<AgentHandlerProcess> handler;
  std::vector<std::vector<uint8_t>> delivered;
  int64_t now = kSecond;
  int32_t published = 0;
  int32_t oldest_kept = 0;
  int32_t acknowledged = -1;
};

}  // namespace pangea

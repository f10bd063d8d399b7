#pragma once

// Emulates a bad link between one agent and the server.
//   agent's link bus:  LINK_UP_k in, LINK_DOWN_k out
//   server's link bus: LINK_DOWN_k in, LINK_UP_k out
//   status bus:        STATUS_link_emulator_k out
// Lost packets are not replaced here: uplink and agent_handler repeat them.

#include <string>
#include <vector>

#include "bus/node.h"
#include "link/poll_loop.h"
#include "link_emulator/link_emulator.h"

namespace pangea {

class LinkEmulatorProcess : public PolledProcess {
 public:
  // `steady_us`: the current time of Poll's clock.
  LinkEmulatorProcess(Bus& agent_link, Bus& server_link, Bus& status_bus, int32_t agent_id,
                      const LinkConditions& conditions, int64_t steady_us);

  int Poll(int64_t steady_us) override;
  void Tick(int64_t now_utime) override;

 private:
  struct Way {
    LinkEmulator emulator;
    Bus& to;
    std::string channel;
    std::string name;                           // in the status: "up", "down"
    std::vector<std::vector<uint8_t>> arrived;  // packets since the last Poll
  };

  static void Relay(Bus& from, Way* way);
  void Count(const Way& way);

  const std::string conditions_;
  const int64_t begin_us_;
  Node node_;
  Way up_;
  Way down_;
};

}  // namespace pangea

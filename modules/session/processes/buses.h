#pragma once

// The LCM buses of one session: all on loopback multicast (ttl 0), each with its own port.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pangea::session {

struct Buses {
  std::string server;
  std::string link;                            // the server's end
  std::map<int32_t, std::string> agents;       // by agent id
  std::map<int32_t, std::string> agent_links;  // only for agents with their own link bus

  const std::string& LinkOf(int32_t agent_id) const {
    const auto own = agent_links.find(agent_id);
    return own == agent_links.end() ? link : own->second;
  }
};

// Chooses free UDP ports. If `first_port` is given: the ports from it upwards, and a port in use is
// an error that names it. `with_own_link`: agents whose link passes through an emulator. Throws
// std::runtime_error.
Buses ChooseBuses(const std::vector<int32_t>& agent_ids, const std::vector<int32_t>& with_own_link,
                  std::optional<uint16_t> first_port);

}  // namespace pangea::session

#pragma once

// The LCM buses of one session: all on loopback multicast (ttl 0), each on a port of its own.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace pangea::session {

struct Buses {
  std::string server;
  std::string link;
  std::map<int32_t, std::string> agents;  // by agent id
};

// Picks free UDP ports; from `first_port` upwards when it is given, and then a port in use is an
// error that names it. Throws std::runtime_error.
Buses ChooseBuses(const std::vector<int32_t>& agent_ids, std::optional<uint16_t> first_port);

}  // namespace pangea::session

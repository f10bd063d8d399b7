#include "session/processes/buses.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>
#include <stdexcept>

namespace pangea::session {
namespace {

constexpr uint32_t kLastPort = 65535;

// LCM's sockets share a port; binding it exclusively shows whether another program uses it.
bool PortIsFree(uint16_t port) {
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  if (fd < 0) {
    throw std::runtime_error("cannot open a UDP socket");
  }
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_ANY);
  address.sin_port = htons(port);
  const bool is_free = bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
  close(fd);
  return is_free;
}

// A port below the kernel's range for automatic ports, which every LCM sender uses: otherwise such
// a socket could take the port between this check and the opening of the bus.
uint32_t RandomPort(size_t needed) {
  constexpr uint32_t kFirst = 20000, kEnd = 32000;
  std::random_device random;
  return kFirst + random() % (kEnd - kFirst - static_cast<uint32_t>(needed));
}

std::string Url(uint16_t port) {
  return fmt::format("udpm://239.255.76.67:{}?ttl=0&recv_buf_size=4194304", port);
}

}  // namespace

Buses ChooseBuses(const std::vector<int32_t>& agent_ids, const std::vector<int32_t>& with_own_link,
                  std::optional<uint16_t> first_port) {
  const size_t needed = 2 + agent_ids.size() + with_own_link.size();
  uint32_t port = first_port ? *first_port : RandomPort(needed);
  const auto next_url = [&] {
    while (port <= kLastPort && !PortIsFree(static_cast<uint16_t>(port))) {
      if (first_port) {
        throw std::runtime_error(fmt::format(
            "UDP port {} is in use: give another --port, or none to have free ones chosen", port));
      }
      ++port;
    }
    if (port > kLastPort) {
      throw std::runtime_error(
          fmt::format("this session needs {} UDP ports, and they end at {}: "
                      "give a smaller --port, or none",
                      needed, kLastPort));
    }
    return Url(static_cast<uint16_t>(port++));
  };
  Buses buses;
  buses.server = next_url();
  buses.link = next_url();
  for (const int32_t id : agent_ids) {
    buses.agents[id] = next_url();
  }
  for (const int32_t id : with_own_link) {
    buses.agent_links[id] = next_url();
  }
  return buses;
}

}  // namespace pangea::session

#include "session/buses.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>
#include <stdexcept>

namespace pangea::session {
namespace {

// LCM shares its port with other programs on the bus; binding it alone tells whether anybody is
// there.
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

std::string Url(uint16_t port) {
  return fmt::format("udpm://239.255.76.67:{}?ttl=0&recv_buf_size=4194304", port);
}

}  // namespace

Buses ChooseBuses(const std::vector<int32_t>& agent_ids, const std::vector<int32_t>& with_own_link,
                  std::optional<uint16_t> first_port) {
  std::random_device random;
  // Below the ports that the kernel gives to sockets without one, as every LCM sender's is: such a
  // socket could take a port between this look and the bus' opening.
  uint16_t port = first_port.value_or(static_cast<uint16_t>(20000 + random() % 12000));
  const auto next_url = [&] {
    while (!PortIsFree(port)) {
      if (first_port) {
        throw std::runtime_error(fmt::format(
            "UDP port {} is in use: give another --port, or none to have free ones chosen", port));
      }
      port = static_cast<uint16_t>(port + 1);
    }
    return Url(port++);
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

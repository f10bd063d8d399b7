#include "bus/transport/host_only.h"

#include <fmt/format.h>
#include <linux/filter.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstring>
#include <filesystem>
#include <regex>
#include <stdexcept>
#include <vector>

namespace pangea {
namespace {

bool IsUdpSocketOf(int fd, uint16_t port) {
  int type = 0;
  socklen_t type_size = sizeof(type);
  sockaddr_in address{};
  socklen_t address_size = sizeof(address);
  return getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &type_size) == 0 && type == SOCK_DGRAM &&
         getsockname(fd, reinterpret_cast<sockaddr*>(&address), &address_size) == 0 &&
         address.sin_family == AF_INET && ntohs(address.sin_port) == port;
}

std::vector<int> UdpSocketsOf(uint16_t port) {
  std::vector<int> sockets;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int fd = std::stoi(entry.path().filename().string());
    if (IsUdpSocketOf(fd, port)) {
      sockets.push_back(fd);
    }
  }
  return sockets;
}

// The kernel's own notes on a packet, beside its bytes (linux/filter.h).
constexpr uint32_t Note(int which) { return static_cast<uint32_t>(SKF_AD_OFF + which); }

void Filter(int socket) {
  constexpr uint32_t kWhole = UINT32_MAX;
  sock_filter code[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, Note(SKF_AD_IFINDEX)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, if_nametoindex("lo"), 2, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, Note(SKF_AD_PKTTYPE)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PACKET_LOOPBACK, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, kWhole),
      BPF_STMT(BPF_RET | BPF_K, 0),
  };
  const sock_fprog program{std::size(code), code};
  if (setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof(program)) != 0) {
    throw std::runtime_error(
        fmt::format("cannot keep other hosts off a bus of this host: {}", std::strerror(errno)));
  }
}

}  // namespace

std::optional<uint16_t> HostOnlyPort(const std::string& url) {
  static const std::regex udpm(R"(udpm://[^:?]*(:(\d{1,5}))?(\?.*)?)");
  static const std::regex far(R"([?&]ttl=0*[1-9])");
  std::smatch parts;
  if (!std::regex_match(url, parts, udpm) || std::regex_search(url, far)) {
    return std::nullopt;
  }
  return static_cast<uint16_t>(parts[2].matched ? std::stoi(parts[2]) : 7667);
}

void TakeOnlyFromThisHost(uint16_t port) {
  const std::vector<int> sockets = UdpSocketsOf(port);
  if (sockets.empty()) {
    throw std::runtime_error(fmt::format(
        "cannot keep other hosts off the bus on port {}: its socket is not found", port));
  }
  for (const int socket : sockets) {
    Filter(socket);
  }
}

}  // namespace pangea

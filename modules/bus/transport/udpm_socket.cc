#include "bus/transport/udpm_socket.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/filter.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <iostream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "bus/transport/udpm_assembler.h"

namespace pangea {
namespace {

constexpr std::string_view kScheme = "udpm://";
constexpr std::string_view kDefaultGroup = "239.255.76.67";

int Number(std::string_view text, int smallest, int largest, const char* what) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < smallest ||
      value > largest) {
    throw std::runtime_error(
        fmt::format("{} '{}' is no number from {} to {}", what, text, smallest, largest));
  }
  return value;
}

// Returns the text before the first separator, and removes it and the separator from `rest`.
std::string_view TakeUntil(std::string_view separators, std::string_view* rest) {
  const size_t end = std::min(rest->find_first_of(separators), rest->size());
  const std::string_view part = rest->substr(0, end);
  rest->remove_prefix(std::min(end + 1, rest->size()));
  return part;
}

void ParseHost(std::string_view host, UdpmAddress* address) {
  const std::string_view group = TakeUntil(":", &host);
  const std::string text(group.empty() ? kDefaultGroup : group);
  if (inet_aton(text.c_str(), &address->group) == 0 ||
      !IN_MULTICAST(ntohl(address->group.s_addr))) {
    throw std::runtime_error(fmt::format("'{}' is no multicast address", text));
  }
  if (!host.empty()) {
    address->port = static_cast<uint16_t>(Number(host, 1, UINT16_MAX, "the port"));
  }
}

// Unknown arguments are ignored here; LCM itself complains about them.
void ParseArgument(std::string_view argument, UdpmAddress* address) {
  const std::string_view key = TakeUntil("=", &argument);
  if (key == "ttl") {
    address->ttl = Number(argument, 0, UINT8_MAX, "ttl");
  } else if (key == "recv_buf_size") {
    address->recv_buf_size = Number(argument, 0, INT32_MAX, "recv_buf_size");
  }
}

// Offset by which a filter reads metadata that the kernel has about a packet (linux/filter.h).
constexpr uint32_t Note(int which) { return static_cast<uint32_t>(SKF_AD_OFF + which); }

constexpr sock_filter kTake = BPF_STMT(BPF_RET | BPF_K, UINT32_MAX);
constexpr sock_filter kDrop = BPF_STMT(BPF_RET | BPF_K, 0);

void AppendHostOnly(std::vector<sock_filter>* code) {
  code->insert(code->end(), {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, Note(SKF_AD_IFINDEX)),
                             BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, if_nametoindex("lo"), 3, 0),
                             BPF_STMT(BPF_LD | BPF_W | BPF_ABS, Note(SKF_AD_PKTTYPE)),
                             BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PACKET_LOOPBACK, 1, 0), kDrop});
}

// If a datagram is too short for the magic number, the load fails, and the kernel drops it.
void AppendMagic(LcmBus::Fragments fragments, std::vector<sock_filter>* code) {
  constexpr uint32_t kUdpHeader = 8;
  code->push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kUdpHeader));
  if (fragments == LcmBus::Fragments::kJoined) {
    code->push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kUdpmFragmentMagic, 1, 0));
  }
  code->insert(code->end(),
               {BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, kUdpmShortMagic, 0, 1), kTake, kDrop});
}

std::vector<sock_filter> FilterOf(const UdpmAddress& address, LcmBus::Fragments fragments) {
  std::vector<sock_filter> code;
  if (address.ttl == 0) {
    AppendHostOnly(&code);
  }
  AppendMagic(fragments, &code);
  return code;
}

class Socket {
 public:
  Socket() : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
    Check(fd_, "a socket");
  }
  ~Socket() {
    if (fd_ >= 0) {
      close(fd_);
    }
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  template <typename Value>
  void Set(int level, int option, const Value& value, const char* what) {
    Check(setsockopt(fd_, level, option, &value, sizeof(value)), what);
  }
  void Bind(uint16_t port) {
    const sockaddr_in address = Inet({htonl(INADDR_ANY)}, port);
    Check(bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), "the port");
  }
  void Connect(in_addr host, uint16_t port) {
    const sockaddr_in address = Inet(host, port);
    Check(connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), "the group");
  }
  // The kernel reports twice the size; half of it is for its own bookkeeping.
  int ReceiveBuffer() const {
    int bytes = 0;
    socklen_t size = sizeof(bytes);
    Check(getsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &bytes, &size), "a receive buffer");
    return bytes / 2;
  }
  int Release() { return std::exchange(fd_, -1); }

 private:
  static sockaddr_in Inet(in_addr host, uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr = host;
    address.sin_port = htons(port);
    return address;
  }
  static void Check(int result, const char* what) {
    if (result < 0) {
      throw std::system_error(errno, std::generic_category(), what);
    }
  }
  int fd_;
};

void ReserveReceiveBuffer(int bytes, Socket* socket) {
  socket->Set(SOL_SOCKET, SO_RCVBUF, bytes, "a receive buffer");
  if (const int given = socket->ReceiveBuffer(); given < bytes) {
    std::cerr << fmt::format(
        "bus: the kernel gives a receive buffer of {} kB, not {} kB: bursts of keyframes are lost "
        "and sent again; sysctl -w net.core.rmem_max={}\n",
        given / 1000, bytes / 1000, bytes);
  }
}

}  // namespace

UdpmAddress ParseUdpmUrl(const std::string& url) {
  UdpmAddress address;
  std::string_view rest = url;
  rest.remove_prefix(std::min(kScheme.size(), rest.size()));
  try {
    ParseHost(TakeUntil("?", &rest), &address);
    while (!rest.empty()) {
      ParseArgument(TakeUntil("&,", &rest), &address);
    }
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(
        fmt::format("cannot open the bus '{}': {}; give udpm://GROUP:PORT?ttl=N, as {}", url,
                    error.what(), kDefaultBusUrl));
  }
  return address;
}

void CheckRoute(const UdpmAddress& address) { Socket().Connect(address.group, address.port); }

int OpenUdpmSocket(const UdpmAddress& address, LcmBus::Fragments fragments) {
  Socket socket;
  std::vector<sock_filter> code = FilterOf(address, fragments);
  socket.Set(SOL_SOCKET, SO_ATTACH_FILTER,
             sock_fprog{static_cast<unsigned short>(code.size()), code.data()}, "a packet filter");
  socket.Set(SOL_SOCKET, SO_REUSEADDR, 1, "sharing the port");
  if (address.recv_buf_size > 0) {
    ReserveReceiveBuffer(address.recv_buf_size, &socket);
  }
  // Else it would also receive what is sent to other groups on this port.
  socket.Set(IPPROTO_IP, IP_MULTICAST_ALL, 0, "one group alone");
  socket.Bind(address.port);
  ip_mreq membership{};
  membership.imr_multiaddr = address.group;
  membership.imr_interface.s_addr = htonl(INADDR_ANY);
  socket.Set(IPPROTO_IP, IP_ADD_MEMBERSHIP, membership, "joining the group");
  return socket.Release();
}

}  // namespace pangea

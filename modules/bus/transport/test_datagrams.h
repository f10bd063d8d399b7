#pragma once

// For tests: sends raw datagrams to an LCM multicast bus, as any program could.

#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "bus/transport/udpm_assembler.h"
#include "bus/transport/udpm_socket.h"
#include "core/big_endian.h"

namespace pangea {

using Datagram = std::vector<uint8_t>;

inline void Append(const std::string& text, Datagram* datagram) {
  datagram->insert(datagram->end(), text.begin(), text.end());
}

// `rest`: the channel, a 0 byte and the data.
inline Datagram ShortDatagram(const std::string& rest) {
  Datagram datagram;
  PutBigEndian(kUdpmShortMagic, 4, &datagram);
  PutBigEndian(1, 4, &datagram);
  Append(rest, &datagram);
  return datagram;
}

struct FragmentHeader {
  uint32_t message_number = 9;
  uint32_t message_bytes = 0;
  uint32_t offset = 0;
  uint16_t number = 0;
  uint16_t count = 0;
};

// `rest`: the data; in fragment number 0 the channel and a 0 byte come first.
inline Datagram FragmentDatagram(const FragmentHeader& header, const std::string& rest) {
  Datagram datagram;
  PutBigEndian(kUdpmFragmentMagic, 4, &datagram);
  PutBigEndian(header.message_number, 4, &datagram);
  PutBigEndian(header.message_bytes, 4, &datagram);
  PutBigEndian(header.offset, 4, &datagram);
  PutBigEndian(header.number, 2, &datagram);
  PutBigEndian(header.count, 2, &datagram);
  Append(rest, &datagram);
  return datagram;
}

// Datagrams that make LCM 1.3.1's own receiver write or read beyond its buffers, and similar ones.
inline std::vector<Datagram> MalformedDatagrams(const std::string& channel) {
  const std::string name = channel + std::string(1, '\0'), data(900, 'x');
  return {
      FragmentDatagram({9, 1000, UINT32_MAX - 49, 0, 2}, name + data),
      FragmentDatagram({10, 1000, UINT32_MAX - 49, 1, 2}, data),
      FragmentDatagram({11, 1000, UINT32_MAX, 0, 2}, name + data),
      FragmentDatagram({12, 1000, 0x80000000, 1, 2}, data),
      FragmentDatagram({13, 10, 0, 0, 2}, name + data),
      FragmentDatagram({14, UINT32_MAX, 0, 0, 2}, name + data),
      FragmentDatagram({15, 0x7fffffff, 0, 0, 2}, name + data),
      FragmentDatagram({16, 900, 0, 0, 0}, name + data),
      FragmentDatagram({17, 900, 0, 7, 2}, data),
      FragmentDatagram({18, 900, 0, 0, 2}, data),  // no channel
      FragmentDatagram({19, 900, 0, 0, 1}, channel),
      FragmentDatagram({20, 0, 0, 0, 1}, name),
      ShortDatagram(channel),  // without the 0 byte
      ShortDatagram(std::string(64, 'A') + name),
      ShortDatagram(name.substr(channel.size()) + data),
      ShortDatagram(""),
      Datagram{'L', 'C', '0', '3'},
      Datagram{'L'},
      Datagram{},
      Datagram(65'000, 0xff),
  };
}

class DatagramSender {
 public:
  explicit DatagramSender(const std::string& url)
      : fd_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const UdpmAddress address = ParseUdpmUrl(url);
    const int ttl = 0;
    setsockopt(fd_, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof(ttl));
    to_.sin_family = AF_INET;
    to_.sin_addr = address.group;
    to_.sin_port = htons(address.port);
  }
  ~DatagramSender() { close(fd_); }
  DatagramSender(const DatagramSender&) = delete;
  DatagramSender& operator=(const DatagramSender&) = delete;

  bool Send(const Datagram& datagram) const {
    return sendto(fd_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&to_),
                  sizeof(to_)) == static_cast<ssize_t>(datagram.size());
  }

 private:
  int fd_;
  sockaddr_in to_{};
};

// A random multicast group and port for this run; the messages stay on this host. The port is below
// those that the kernel gives to unbound sockets, which LCM's senders use.
inline std::string OwnBusUrl() {
  static std::random_device device;
  return "udpm://239." + std::to_string(192 + device() % 60) + "." +
         std::to_string(device() % 256) + "." + std::to_string(1 + device() % 250) + ":" +
         std::to_string(20000 + device() % 12000) + "?ttl=0&recv_buf_size=4194304";
}

}  // namespace pangea

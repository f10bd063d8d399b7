#pragma once

// The receiving socket of an LCM multicast bus (udpm://). As LCM's, it is bound to the port at
// every address, and is a member of the group on the interface of the multicast route. Unlike
// LCM's, it receives no other group's datagrams on this port. In addition it has a packet filter in
// the kernel, set before it is bound:
// - With ttl=0, no message leaves this host, and the filter also drops all datagrams from other
//   hosts, both multicast and unicast. Only datagrams over the loopback interface pass, and the
//   host's own multicast, looped back.
// - Datagrams that do not begin as LCM's are dropped, and fragments too if they are not wanted.

#include <netinet/in.h>

#include <cstdint>
#include <string>

#include "bus/bus.h"

namespace pangea {

// "udpm://GROUP:PORT?ttl=N&recv_buf_size=N", with LCM's defaults except for recv_buf_size: LCM
// would leave the kernel's 200 kB, which lose keyframes when many come at once.
struct UdpmAddress {
  in_addr group{};
  uint16_t port = 7667;
  int ttl = 0;
  int recv_buf_size = 4 << 20;  // bytes; 0: the kernel's default
};

// Throws std::runtime_error with the URL and what is wrong with it.
UdpmAddress ParseUdpmUrl(const std::string& url);

// Throws std::system_error when this machine has no route to the group.
void CheckRoute(const UdpmAddress& address);

// Opens the socket, non-blocking, and returns its file descriptor, which the caller closes. Throws
// std::system_error. If the kernel gives it a smaller receive buffer than asked for, says on stderr
// what to do.
int OpenUdpmSocket(const UdpmAddress& address, LcmBus::Fragments fragments);

}  // namespace pangea

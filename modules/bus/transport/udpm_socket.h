#pragma once

// The receiving socket of an LCM multicast bus (udpm://), as LCM has it: bound to the port at every
// address, a member of the group on the interface that the multicast route names. And a packet
// filter in the kernel from before it is bound:
// - A bus of this host alone (ttl=0: nothing published on it leaves the host) takes nothing from
//   other hosts either, by multicast or straight to the port: only what came over the loopback
//   interface or is the host's own multicast, looped back.
// - What does not begin as an LCM datagram is dropped, and fragments too where they are not wanted.

#include <netinet/in.h>

#include <cstdint>
#include <string>

#include "bus/bus.h"

namespace pangea {

// "udpm://GROUP:PORT?ttl=N&recv_buf_size=N", each with LCM's default but the last: the kernel's
// 200 kB, which LCM leaves as they are, lose bursts of keyframes.
struct UdpmAddress {
  in_addr group{};
  uint16_t port = 7667;
  int ttl = 0;
  int recv_buf_size = 4 << 20;  // bytes; 0: the kernel's default
};

// Throws std::runtime_error naming the URL and what is wrong with it.
UdpmAddress ParseUdpmUrl(const std::string& url);

// Throws std::system_error when this machine has no route to the group.
void CheckRoute(const UdpmAddress& address);

// Opens the socket, non-blocking; throws std::system_error. Says on stderr when the kernel gives it
// a smaller receive buffer than asked for, and what to do.
int OpenUdpmSocket(const UdpmAddress& address, LcmBus::Fragments fragments);

}  // namespace pangea

#pragma once

// A bus of this host alone (udpm with ttl=0: nothing published on it leaves the host) takes nothing
// from other hosts either. LCM binds its socket to every address, so whoever reaches the machine
// could talk to the bus, by multicast or straight to the port. LCM does not hand its socket out;
// it is found among this process' own by its port, and given a packet filter that lets in what came
// over the loopback interface or is the host's own multicast, looped back.

#include <cstdint>
#include <optional>
#include <string>

namespace pangea {

// The port of a bus that stays on this host: "udpm://...:7667?ttl=0". None for other buses. LCM's
// defaults hold: port 7667, ttl 0.
std::optional<uint16_t> HostOnlyPort(const std::string& url);

// Puts the filter on every UDP socket of this process that is bound to the port. Throws
// std::runtime_error if there is none, or the kernel refuses.
void TakeOnlyFromThisHost(uint16_t port);

}  // namespace pangea

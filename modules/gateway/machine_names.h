#pragma once

// The names and addresses of this machine.

#include <string>

#include "gateway/certificates.h"

namespace pangea {

// The host name alone and with ".local", "localhost", and the addresses of the interfaces.
MachineNames NamesOfThisMachine();

// Adds a name or an address that the user has given. Throws std::runtime_error if it is neither.
void AddTo(MachineNames* names, const std::string& host);

// The address of the interface that leads to other networks, else ReachableOf(names).
std::string AddressForOthers(const MachineNames& names);
// The first address that other machines can reach, IPv4 before IPv6; else 127.0.0.1.
std::string ReachableOf(const MachineNames& names);

// The address to listen on for all networks: "::" is for IPv6 and IPv4. Without IPv6 in the kernel,
// "0.0.0.0".
std::string AnyAddress();

}  // namespace pangea

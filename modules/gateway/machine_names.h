#pragma once

// The names and addresses of this machine.

#include <string>

#include "gateway/certificates.h"

namespace pangea {

// The host name alone and with ".local", "localhost", and the addresses of the interfaces.
MachineNames NamesOfThisMachine();

// Adds a name or an address that the user has given.
void AddTo(MachineNames* names, const std::string& host);

// The address of the interface that leads to other networks; else any address that other machines
// can reach; else 127.0.0.1.
std::string AddressForOthers(const MachineNames& names);

}  // namespace pangea

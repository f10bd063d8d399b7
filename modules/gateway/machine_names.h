#pragma once

// What this machine is called, and where it can be reached.

#include <string>

#include "gateway/certificates.h"

namespace pangea {

// Its name, alone and with ".local", "localhost", and the addresses of its interfaces.
MachineNames NamesOfThisMachine();

// The address of the interface that leads to other networks; else any that is not its own alone,
// else 127.0.0.1.
std::string AddressForOthers(const MachineNames& names);

}  // namespace pangea

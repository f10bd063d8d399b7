#pragma once

// The files of a site that are copied, and the part of its journal that can be copied while a
// server writes.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "site/site.h"

namespace pangea::site {

// The files agent_<id>.key and <process>.yaml, sorted; empty if there is no folder.
std::vector<std::filesystem::path> KeyFiles(const Site& site);
std::vector<std::filesystem::path> OptionFiles(const Site& site);
// GatewayAgentFiles: the agents that joined by invite; every copy has them, so that no id is given
// twice. Invites are not copied: a code is valid once. GatewayIdentityFiles: the gateway's
// identity, copied only with the keys.
std::vector<std::filesystem::path> GatewayAgentFiles(const Site& site);
std::vector<std::filesystem::path> GatewayIdentityFiles(const Site& site);

// Whether a copy of a site may contain a file with this relative name. A check of foreign archives:
// no file is written outside the site.
bool IsFileOfSite(const std::string& name);

struct WholePart {
  int64_t bytes = 0;       // from the start to its end
  int64_t events = 0;      // complete events in it, including CHECKSUMS
  int64_t lost_bytes = 0;  // of damaged parts in it
};

// The complete part of a site's journal: up to its last complete event or, while a server writes
// it, up to its last CHECKSUMS, if it has any. Empty for a missing journal. Throws
// std::runtime_error if it cannot be read.
WholePart FindWholePart(const Site& site);

}  // namespace pangea::site

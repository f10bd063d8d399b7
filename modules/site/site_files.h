#pragma once

// The files of a site that a copy of it has, and where its journal may be cut while a server writes
// it.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "site/site.h"

namespace pangea::site {

// agent_<id>.key and <process>.yaml: sorted; empty where there is no folder.
std::vector<std::filesystem::path> KeyFiles(const Site& site);
std::vector<std::filesystem::path> OptionFiles(const Site& site);
// Who joined by an invite: each copy has them, so that nobody gets the id of another. Invites stay
// here: a code is good once. And by what the gateway is known, which goes where keys go.
std::vector<std::filesystem::path> GatewayAgentFiles(const Site& site);
std::vector<std::filesystem::path> GatewayIdentityFiles(const Site& site);

// Whether a copy of a site may have a file of that name, relative to its folder: what comes from
// elsewhere is not written anywhere else.
bool IsFileOfSite(const std::string& name);

struct WholePart {
  int64_t bytes = 0;       // from the file's begin, up to the end of its last whole group
  int64_t events = 0;      // whole ones in it, CHECKSUMS among them
  int64_t lost_bytes = 0;  // damaged ones
};

// What of a journal is written to its end: up to its last CHECKSUMS, or, in one that has none, its
// last whole event. Nothing of one that is not there yet. Throws std::runtime_error when it cannot
// be read.
WholePart FindWholePart(const std::filesystem::path& journal);

}  // namespace pangea::site

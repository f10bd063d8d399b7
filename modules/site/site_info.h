#pragma once

// What sites there are, and what is in one. Both only read, and servers may run.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/ids.h"
#include "log_file/log_reading.h"
#include "site/site.h"

namespace pangea::site {

struct SiteInfo {
  Site site;
  std::optional<int> user;                       // process id of who has its lock
  int64_t bytes = 0;                             // of its folder
  int64_t free_bytes = 0;                        // of its disk
  std::map<MapId, std::set<int32_t>> keyframes;  // seqs by map
  int64_t matches = 0;
  int64_t constraints_accepted = 0, constraints_refused = 0;
  int64_t anchors = 0;                             // that are not deleted
  std::optional<int64_t> first_utime, last_utime;  // of what is in the journal, wall clock
  LogReading reading;
  std::map<std::string, std::string> checkpoints;  // of each process: what it covers, for people
};

// Reads all of the journal. Throws std::runtime_error when it cannot be read.
SiteInfo ReadInfo(const Site& site);
// For people.
std::string ToText(const SiteInfo& info);

// The folders that sites are in if nobody says otherwise, as far as they are there:
// ~/.local/share/pangea, /var/lib/pangea.
std::vector<std::filesystem::path> DefaultSiteFolders();
// The sites in a folder, by name of their own folder, a line each: name, folder, size, state.
// Throws std::runtime_error when it is no folder.
std::string ListSites(const std::filesystem::path& folder);

}  // namespace pangea::site

#pragma once

// Lists sites, and describes the contents of one. Both only read; servers may run.

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
  std::optional<int> user;                       // process id of the program that has locked it
  int64_t bytes = 0;                             // size of its folder
  int64_t free_bytes = 0;                        // free on its disk
  std::map<MapId, std::set<int32_t>> keyframes;  // seqs by map
  // Where the odometry edges begin that lead over keyframes; those do not exist (thinning).
  std::map<KeyframeId, int32_t> long_edges;
  int64_t matches = 0;
  int64_t constraints_accepted = 0, constraints_refused = 0;
  int64_t anchors = 0;                             // not deleted
  std::optional<int64_t> first_utime, last_utime;  // of the journal's events, wall clock
  LogReading reading;
  // `reading`, but while a server runs, an incomplete last event is no damage: it is being written.
  LogReading damage() const;
  std::map<std::string, std::string> checkpoints;  // by process: what it covers, for people
};

// Reads the whole journal. Throws std::runtime_error if it cannot be read.
SiteInfo ReadInfo(const Site& site);
// A text for people.
std::string ToText(const SiteInfo& info);

// The existing ones of the default folders of sites: ~/.local/share/pangea, /var/lib/pangea.
std::vector<std::filesystem::path> DefaultSiteFolders();
// Lists the sites in a folder, sorted by their folders' names, one line each: name, folder, size,
// state; then the folders in it that one may not read. Throws std::runtime_error if it is no
// folder, or one may not read it.
std::string ListSites(const std::filesystem::path& folder);

}  // namespace pangea::site

#pragma once

// Copies of a site, made while its server runs: site.yaml, options, who joined, the journal up to
// what is written to its end, and, if wanted, the keys: the agents' and the gateway's.

#include <cstdint>
#include <filesystem>

#include "site/site.h"

namespace pangea::site {

struct BackupSummary {
  int64_t journal_bytes = 0;
  int64_t events = 0;
  int64_t lost_bytes = 0;  // by damage, as the journal has it
  int64_t bytes = 0;       // of the file or folder that was written
};

// To a new FILE.tar.zst, or, under another name, to a new folder, which is a site. What was written
// is read again and compared; it has its name only then. Throws std::runtime_error.
BackupSummary BackUp(const Site& site, const std::filesystem::path& to, bool with_keys);

// A new site from a backup. Throws std::runtime_error: `from` is no backup or damaged, there is
// something at `folder`, the disk refuses; then there is no new site.
BackupSummary Restore(const std::filesystem::path& from, const std::filesystem::path& folder);

}  // namespace pangea::site

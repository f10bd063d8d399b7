#pragma once

// Copies a site, also while its server runs: site.yaml, options, the agents that joined by invite,
// the complete part of the journal (site_files.h), and optionally the keys of agents and gateway.

#include <cstdint>
#include <filesystem>

#include "site/site.h"

namespace pangea::site {

struct BackupSummary {
  int64_t journal_bytes = 0;
  int64_t events = 0;
  int64_t lost_bytes = 0;  // of the journal itself: damaged, or incomplete at its end
  int64_t bytes = 0;       // size of the backup
};

// Backs up to a new FILE.tar.zst or, with any other name, to a new folder, which is a site. The
// copy is read again and compared, and only then gets its name. Throws std::runtime_error.
BackupSummary BackUp(const Site& site, const std::filesystem::path& to, bool with_keys);

// Makes a new site from a backup. Throws std::runtime_error, and makes no site, if `from` is no
// backup or is damaged, `folder` exists, or a write fails.
BackupSummary Restore(const std::filesystem::path& from, const std::filesystem::path& folder);

}  // namespace pangea::site

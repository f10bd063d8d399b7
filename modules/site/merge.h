#pragma once

// Merges two sites, for instance recorded on different days: the new site's journal has the
// contents of the first journal, followed by the keyframes of the second, as if they had come
// later. The server that starts on it recognises places of the first site in the second's
// keyframes, and fuses the maps like those of two agents.
//
// Copied from the second site: keyframes, verification results between its maps, derived
// constraints, and anchor edits, renumbered after those of the first. Not copied: its place matches
// and its verification results within a map. A keyframe is matched only once, so without a match it
// will be matched with all keyframes of the new site; an old result would then count twice, beside
// the new one.

#include <cstdint>
#include <filesystem>

#include "site/site.h"

namespace pangea::site {

struct MergeOptions {
  std::string name;        // of the new site; empty: name of its folder
  bool with_keys = false;  // copy the keys of both sites
};

struct MergeSummary {
  int64_t keyframes_first = 0, keyframes_second = 0;
  int64_t maps_in_both = 0;  // copied once
  int64_t anchor_edits = 0;
  int64_t bytes_lost = 0;  // damaged, in both journals
};

// Options, buses and file mode are those of the first site. Both sites are only read, and their
// servers may run. Throws std::runtime_error, and makes no site, if a map in both sites differs, an
// agent has two keys, `out` exists, or a write fails.
MergeSummary MergeSites(const Site& first, const Site& second, const std::filesystem::path& out,
                        const MergeOptions& options);

}  // namespace pangea::site

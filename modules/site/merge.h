#pragma once

// Two sites, recorded on different days, as one: a new site whose journal has what the first's has,
// and behind it the second's keyframes, as if they had come after. The server that starts on it
// looks for the first's places in the second's keyframes, and fuses the maps as it does those of
// two agents.
//
// Of the second site go along: keyframes, verification results between its maps, anchor edits,
// numbered on from the first's. Its place matches and its verification results within a map do not:
// each keyframe is matched once, and without a match it is matched with all that is there now; a
// result of then would count twice beside the one of now.

#include <cstdint>
#include <filesystem>

#include "site/site.h"

namespace pangea::site {

struct MergeOptions {
  std::string name;        // of the new site; empty: its folder's
  bool with_keys = false;  // both sites' keys too
};

struct MergeSummary {
  int64_t keyframes_first = 0, keyframes_second = 0;
  int64_t maps_in_both = 0;  // taken once
  int64_t anchor_edits = 0;
  int64_t bytes_lost = 0;  // of the two journals, by damage
};

// Options, buses and mode are the first's. The two are only read, and servers may run on them.
// Throws std::runtime_error: a map is in both and differs, an agent has two keys, `out` exists, the
// disk refuses. Then there is no `out`.
MergeSummary MergeSites(const Site& first, const Site& second, const std::filesystem::path& out,
                        const MergeOptions& options);

}  // namespace pangea::site

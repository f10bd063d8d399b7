#pragma once

// Makes a site's journal smaller: removes repeats, options replaced by newer ones, and the
// placeholders of damaged parts. Keyframes, matches, verification results and anchor edits stay,
// with the same bytes and in the same order. With thinning, keyframes whose view newer maps contain
// are removed too (thinning/thinning.h).
//
// The new journal is written beside the old one, flushed to the disk, compared with the old one,
// and then renamed atomically: whenever the program is killed, the journal is either the complete
// old one or the complete new one.

#include <cstdint>
#include <functional>
#include <optional>

#include "site/site.h"
#include "thinning/thinning.h"

namespace pangea::site {

enum class CompactStep : uint8_t { kRead, kWrite, kWritten, kCompared, kSwapped, kDone };

struct CompactSummary {
  bool damaged = false;  // the old journal; a copy of the damage is kept beside it
  int64_t bytes_before = 0, bytes_after = 0;
  int64_t events_before = 0, events_after = 0;
  int64_t keyframes_gone = 0, constraints_derived = 0;  // only with thinning
};

struct ThinJournal {
  ThinningOptions options;
  int64_t now_utime = 0;  // wall clock
};

// `on_step` is called when a step is reached; for kWrite, before each event. Throws
// std::runtime_error, and keeps the old journal, if a server runs, there is no journal, or a write
// fails.
CompactSummary Compact(
    const Site& site, const std::optional<ThinJournal>& thin = std::nullopt,
    const std::function<void(CompactStep)>& on_step = [](CompactStep) {});

}  // namespace pangea::site

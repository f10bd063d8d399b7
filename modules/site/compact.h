#pragma once

// Makes a site's journal smaller: repeats, options that newer ones replaced, and what only fills
// the place of damage go. Keyframes, matches, verification results and anchor edits stay, byte by
// byte and in their order; thinned, also keyframes go whose view newer maps have
// (thinning/thinning.h).
//
// The new journal is written beside the old one, brought to the disk, compared with it, and then
// takes its name in one step: whatever ends the program, the journal is the old one or the new one,
// whole.

#include <cstdint>
#include <functional>
#include <optional>

#include "site/site.h"
#include "thinning/thinning.h"

namespace pangea::site {

enum class CompactStep : uint8_t { kRead, kWrite, kWritten, kCompared, kSwapped, kDone };

struct CompactSummary {
  int64_t bytes_before = 0, bytes_after = 0;
  int64_t events_before = 0, events_after = 0;
  int64_t keyframes_gone = 0, constraints_derived = 0;  // by thinning
};

struct ThinJournal {
  ThinningOptions options;
  int64_t now_utime = 0;  // wall clock
};

// `on_step` is called when a step is reached, of kWrite before each event. Throws
// std::runtime_error: a server runs, there is no journal, the disk refuses. Then the old one
// stands.
CompactSummary Compact(
    const Site& site, const std::optional<ThinJournal>& thin = std::nullopt,
    const std::function<void(CompactStep)>& on_step = [](CompactStep) {});

}  // namespace pangea::site

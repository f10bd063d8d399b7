#pragma once

// Rewrites a journal's events for a thinning: removed keyframes disappear, and derived constraints
// replace their constraints.

#include <cstdint>
#include <filesystem>
#include <functional>

#include "log_file/log_reader.h"
#include "site/compact.h"
#include "thinning/thinning.h"

namespace pangea::site {

class ThinnedJournal {
 public:
  explicit ThinnedJournal(ThinnedMaps thinned) : thinned_(std::move(thinned)) {}

  using Write = std::function<void(const LogEvent&)>;
  // Call for each event in order: writes what remains of it, if anything does.
  void Rewrite(const LogEvent& event, const Write& write);
  // Writes the new events (derived constraints), after the last event.
  void Finish(const Write& write) const;

  int64_t keyframes_gone() const { return std::ssize(thinned_.gone); }
  int64_t constraints_derived() const { return std::ssize(thinned_.derived); }

 private:
  void RewriteKeyframe(const LogEvent& event, const Write& write) const;
  void RewriteMatch(const LogEvent& event, const Write& write) const;
  void RewriteConstraint(const LogEvent& event, const Write& write) const;

  ThinnedMaps thinned_;
  int64_t latest_utime_ = 0;
};

// Computes the thinning of a journal, with the options of its processes. Writes nothing.
ThinnedJournal Thin(const std::filesystem::path& journal, const ThinJournal& how);

}  // namespace pangea::site

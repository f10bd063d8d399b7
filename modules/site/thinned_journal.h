#pragma once

// A journal's events as they are after a thinning: of keyframes that go nothing is left, but in
// constraints that took the place of theirs.

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
  // Call it for each event in order: writes what is left of it, if anything is.
  void Rewrite(const LogEvent& event, const Write& write);
  // What is new, behind the last event.
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

// Reads the journal, with the options of its processes. Nothing is written.
ThinnedJournal Thin(const std::filesystem::path& journal, const ThinJournal& how);

}  // namespace pangea::site

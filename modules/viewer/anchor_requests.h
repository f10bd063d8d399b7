#pragma once

// Edits of anchors that are not shown yet. Each is published once per second until the journal has
// it, at most for kPatience_us, or until another edit has overridden it. It is kept until the
// anchor is shown with it, so that the next edit of the anchor has a higher revision. Bounded. No
// bus, no clock.

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/anchor.h"

namespace pangea::viewer {

class AnchorRequests {
 public:
  static constexpr int64_t kInterval_us = 1'000'000;
  static constexpr int64_t kPatience_us = 20'000'000;
  static constexpr size_t kMaxPending = 100;  // anchors

  // Adds an edit. If an edit of the same anchor is still kept, it is replaced, with a revision one
  // higher. False if too many edits are kept.
  bool Add(AnchorEdit edit, int64_t now_utime);
  // The journal has this edit. Returns ours if it is lost by that; it is removed.
  std::optional<AnchorEdit> TakeLost(const AnchorEdit& journalled);
  // The anchor is shown with this revision.
  void Shown(const AnchorId& anchor, int64_t revision);
  // The edits to publish now.
  std::vector<AnchorEdit> Due(int64_t now_utime);
  // The edits that the journal did not get in time; they are removed.
  std::vector<AnchorEdit> TakeGivenUp(int64_t now_utime);

  size_t size() const { return pending_.size(); }

 private:
  struct Pending {
    AnchorEdit edit;
    int64_t since_utime = 0;
    int64_t next_utime = 0;
    bool journalled = false;
  };

  std::map<AnchorId, Pending> pending_;
};

}  // namespace pangea::viewer

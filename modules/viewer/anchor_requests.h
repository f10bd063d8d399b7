#pragma once

// Edits of anchors that are not in the journal yet. Each is published once per second until the
// journal has it, at most for kPatience_us. Bounded. No bus, no clock.

#include <cstdint>
#include <map>
#include <vector>

#include "core/anchor.h"

namespace pangea::viewer {

class AnchorRequests {
 public:
  static constexpr int64_t kInterval_us = 1'000'000;
  static constexpr int64_t kPatience_us = 20'000'000;
  static constexpr size_t kMaxPending = 100;  // anchors

  // Adds an edit. If an edit of the same anchor is still pending, it is replaced, with a revision
  // one higher. False if too many edits are pending.
  bool Add(AnchorEdit edit, int64_t now_utime);
  // The journal has this revision of the anchor, or a later one.
  void Heard(const AnchorId& anchor, int64_t revision);
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
  };

  std::map<AnchorId, Pending> pending_;
};

}  // namespace pangea::viewer

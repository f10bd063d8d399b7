#pragma once

// Edits of anchors on their way into the journal: each said once a second until it is heard from
// there, or for kPatience_us. Bounded. No bus, no clock.

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

  // An edit of an anchor whose last one is still on its way takes its place, one revision further.
  // False: too many are on their way.
  bool Add(AnchorEdit edit, int64_t now_utime);
  // The journal has this revision of the anchor, or a later one.
  void Heard(const AnchorId& anchor, int64_t revision);
  // What to say now.
  std::vector<AnchorEdit> Due(int64_t now_utime);
  // Those that were not heard in time, each once.
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

#pragma once

// Who the core of a site is: a record in NATS with its holder's name, which the holder writes anew
// again and again, each time only if it is still the newest (compare and set by sequence). One that
// has not moved for kHeld_us, as seen from here, is free to be taken; so no two hosts' clocks are
// compared. While NATS does not answer nobody takes it, and the time starts anew: then its holder
// cannot have written either.
//
// The sequence with which it was taken is the holder's term. Whoever is cut off or asleep for
// longer does not know that another has it: so the lease alone keeps nobody from writing. The terms
// in the site's journal do (journal_shipper.h). Clock: WallUtime, which never steps. One thread.

#include <cstdint>
#include <optional>
#include <string>

#include "cluster/site_streams.h"

namespace pangea {

class SiteLease {
 public:
  static constexpr int64_t kHeld_us = 4'000'000;
  static constexpr int64_t kRenew_us = 500'000;
  // What relies on the lease stops when it was not written for so long, well before it is free.
  static constexpr int64_t kFresh_us = 2'000'000;

  // `holder`: a name that nobody else has, without blanks.
  SiteLease(SiteStreams& streams, std::string holder);

  // At about 10 Hz until it is ours; whether it is.
  bool TryAcquire(int64_t now_utime);
  // At about 10 Hz while it is ours; false once another has it.
  bool Renew(int64_t now_utime);
  // Another need not wait.
  void Release();

  // With which it was taken.
  uint64_t term() const { return term_; }
  bool fresh(int64_t now_utime) const { return now_utime - renewed_utime_ < kFresh_us; }
  // Who has it, as far as is known; for people.
  const std::string& seen_holder() const { return seen_holder_; }

 private:
  bool Write(const std::string& record, uint64_t behind, int64_t now_utime);

  SiteStreams& streams_;
  const std::string holder_;
  uint64_t term_ = 0;
  uint64_t sequence_ = 0;  // of our newest record, while it is ours
  int64_t renewed_utime_ = 0;
  std::optional<uint64_t> seen_;  // the newest record, while it is not
  std::string seen_holder_;
  int64_t seen_utime_ = 0;  // since when
};

}  // namespace pangea

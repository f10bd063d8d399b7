#include "cluster/site_lease.h"

#include <utility>

namespace pangea {
namespace {

constexpr char kNobody[] = "-";

}  // namespace

SiteLease::SiteLease(SiteStreams& streams, std::string holder)
    : streams_(streams), holder_(std::move(holder)) {}

bool SiteLease::Write(const std::string& record, uint64_t behind, int64_t now_utime) {
  const SiteStreams::StoreAnswer answer = streams_.StoreLease(record, behind);
  if (answer.stored != SiteStreams::Stored::kNew) {
    return false;
  }
  sequence_ = answer.sequence;
  renewed_utime_ = now_utime;
  return true;
}

bool SiteLease::TryAcquire(int64_t now_utime) {
  const auto newest = streams_.LeaseSequence();
  if (newest != seen_) {
    const auto record = streams_.FindLease();
    if (newest && *newest > 0 && !record) {
      return false;  // somebody has it, and NATS does not say who
    }
    seen_ = newest;
    seen_utime_ = now_utime;
    seen_holder_ = record.value_or(kNobody);
  }
  const bool free = newest && (seen_holder_ == kNobody || seen_holder_ == holder_ ||
                               now_utime - seen_utime_ >= kHeld_us);
  if (!free || !Write(holder_, *newest, now_utime)) {
    return false;
  }
  term_ = sequence_;
  seen_holder_ = holder_;
  return true;
}

bool SiteLease::Renew(int64_t now_utime) {
  if (now_utime - renewed_utime_ < kRenew_us || Write(holder_, sequence_, now_utime)) {
    return true;
  }
  // Either our record was written and NATS' answer was lost, or another host has the lease.
  const auto newest = streams_.LeaseSequence();
  if (!newest || *newest == sequence_) {
    return true;
  }
  const auto record = streams_.FindLease();
  if (record && *record != holder_) {
    seen_holder_ = *record;
    return false;
  }
  sequence_ = record ? *newest : sequence_;
  return true;
}

void SiteLease::Release() { streams_.StoreLease(kNobody, sequence_); }

}  // namespace pangea

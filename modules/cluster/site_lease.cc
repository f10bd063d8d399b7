#include "cluster/site_lease.h"

#include <utility>

namespace pangea {
namespace {

constexpr char kNobody[] = "-";

}  // namespace

SiteLease::SiteLease(LeaseRecords& records, std::string holder)
    : records_(records), holder_(std::move(holder)) {}

std::optional<std::string> SiteLease::HolderAt(uint64_t sequence) {
  const auto record = records_.FindLease();
  return record && record->sequence == sequence
             ? std::optional(std::string(record->data.begin(), record->data.end()))
             : std::nullopt;
}

bool SiteLease::Write(const std::string& record, uint64_t behind, int64_t now_utime) {
  const NatsClient::StoreAnswer answer = records_.StoreLease(record, behind);
  if (answer.stored != NatsClient::Stored::kNew) {
    return false;
  }
  sequence_ = answer.sequence;
  renewed_utime_ = now_utime;
  return true;
}

bool SiteLease::TryAcquire(int64_t now_utime) {
  const auto newest = records_.LeaseSequence();
  if (newest != seen_) {
    const auto holder = newest ? HolderAt(*newest) : std::nullopt;
    if (newest && *newest > 0 && !holder) {
      return false;  // somebody has it, and NATS does not say who
    }
    seen_ = newest;
    seen_utime_ = now_utime;
    seen_holder_ = holder.value_or(kNobody);
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

bool SiteLease::is_anothers() const {
  return seen_ > 0u && seen_holder_ != kNobody && seen_holder_ != holder_;
}

bool SiteLease::Renew(int64_t now_utime) {
  if (now_utime - renewed_utime_ < kRenew_us || Write(holder_, sequence_, now_utime)) {
    return true;
  }
  // Either our record was written and NATS' answer was lost, or another host has the lease. An
  // older record is from a former leader of the stream, which does not know of ours.
  const auto newest = records_.LeaseSequence();
  if (!newest || *newest <= sequence_) {
    return true;
  }
  const auto holder = HolderAt(*newest);
  if (holder && *holder != holder_) {
    seen_holder_ = *holder;
    return false;
  }
  sequence_ = holder ? *newest : sequence_;
  return true;
}

void SiteLease::Release() { records_.StoreLease(kNobody, sequence_); }

}  // namespace pangea

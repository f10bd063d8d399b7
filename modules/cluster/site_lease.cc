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
  renewed_ = answer.stored == NatsClient::Stored::kNew;
  if (!renewed_) {
    return false;
  }
  sequence_ = answer.sequence;
  renewed_utime_ = now_utime;
  return true;
}

bool SiteLease::TryAcquire(int64_t now_utime) {
  const auto newest = records_.LeaseSequence();
  if (!newest) {
    answers_utime_.reset();
    return false;
  }
  answers_utime_ = answers_utime_.value_or(now_utime);
  if (newest != seen_) {
    const auto holder = HolderAt(*newest);
    if (*newest > 0 && !holder) {
      return false;  // somebody has it, and NATS does not say who
    }
    if (seen_holder_ != holder.value_or(kNobody)) {
      seen_holder_ = holder.value_or(kNobody);
      sign_utime_.reset();
    }
    seen_ = newest;
    seen_utime_ = now_utime;
  }
  if (!IsFree(now_utime) || !Write(holder_, *newest, now_utime)) {
    return false;
  }
  term_ = sequence_;
  seen_holder_ = holder_;
  return true;
}

bool SiteLease::IsFree(int64_t now_utime) const {
  if (seen_holder_ == kNobody || seen_holder_ == holder_) {
    return true;
  }
  const int64_t answers_us = now_utime - *answers_utime_;
  const int64_t unchanged_us = now_utime - seen_utime_;
  const bool fell_silent = sign_utime_ && now_utime - *sign_utime_ >= kHeld_us;
  return unchanged_us >= kHeld_us && answers_us >= (fell_silent ? kHeard_us : kHeld_us);
}

void SiteLease::NoteSign(const std::string& holder, int64_t now_utime) {
  if (holder == seen_holder_) {
    sign_utime_ = now_utime;
  }
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

#pragma once

// The lease that says which host is the core of a site. It is a record in NATS with the holder's
// name. The holder renews it by writing it again and again, each time only if its own record is
// still the newest (compare and set by sequence). If this host has seen no new record for kHeld_us,
// the lease is free; so clocks of two hosts are never compared. While NATS does not answer, nobody
// takes the lease, and the time starts again, because the holder could not renew it either.
//
// NATS does not answer for up to 9 s when a node fails, until the lease's stream has another
// leader. If the server's host failed with it, its standby should not wait for kHeld_us once more.
// So the holder also gives signs of life, which are not stored. If they were heard and then were
// not for kHeld_us, the lease is free as soon as NATS answers. Without any, as before.
//
// The sequence of the record that took the lease is the holder's term. A host that was cut off or
// suspended does not know that another one has the lease, so the lease alone does not prevent it
// from writing. The terms in the site's journal do (journal_shipper.h). The clock is WallUtime,
// which never steps. Not thread safe.

#include <cstdint>
#include <optional>
#include <string>

#include "cluster/nats/nats_client.h"

namespace pangea {

// The lease's records in NATS (site_streams.h). Nothing if NATS does not answer.
class LeaseRecords {
 public:
  virtual ~LeaseRecords() = default;
  // The sequence of the newest record, as the stream's leader knows it; 0: there is no record.
  // After a cut of the network, a former leader may answer.
  virtual std::optional<uint64_t> LeaseSequence() = 0;
  // The newest record, or an older one if a replica answers that lags.
  virtual std::optional<NatsClient::Message> FindLease() = 0;
  // Stores a record if the newest one has the sequence `behind`.
  virtual NatsClient::StoreAnswer StoreLease(const std::string& record, uint64_t behind) = 0;
};

class SiteLease {
 public:
  static constexpr int64_t kHeld_us = 4'000'000;
  static constexpr int64_t kRenew_us = 500'000;
  // A holder gives a sign of life at this interval. One that lives is heard within kHeard_us after
  // NATS answers again.
  static constexpr int64_t kSign_us = 200'000;
  static constexpr int64_t kHeard_us = 600'000;
  // When the lease was not renewed for this time, the core stops what relies on it, well before the
  // lease is free.
  static constexpr int64_t kFresh_us = 2'000'000;

  // `holder`: a unique name without blanks.
  SiteLease(LeaseRecords& records, std::string holder);

  // Call it at about 10 Hz until it returns true: then we hold the lease.
  bool TryAcquire(int64_t now_utime);
  // A sign of life of this holder came.
  void NoteSign(const std::string& holder, int64_t now_utime);
  // Call it at about 10 Hz while we hold the lease. False if another host has it.
  bool Renew(int64_t now_utime);
  // Gives the lease up, so that another host need not wait.
  void Release();

  // The term with which the lease was taken.
  uint64_t term() const { return term_; }
  // False also after a renewal that failed: it may have waited for NATS longer than `now_utime`
  // says.
  bool fresh(int64_t now_utime) const { return renewed_ && now_utime - renewed_utime_ < kFresh_us; }
  // Whether the newest record that TryAcquire has seen is another host's.
  bool is_anothers() const;
  // For people: the last known holder.
  const std::string& seen_holder() const { return seen_holder_; }

 private:
  // The holder in the record with this sequence. Nothing also if a replica that lags answers.
  std::optional<std::string> HolderAt(uint64_t sequence);
  bool Write(const std::string& record, uint64_t behind, int64_t now_utime);
  bool IsFree(int64_t now_utime) const;

  LeaseRecords& records_;
  const std::string holder_;
  uint64_t term_ = 0;
  uint64_t sequence_ = 0;  // of our newest record, while we hold the lease
  int64_t renewed_utime_ = 0;
  bool renewed_ = false;          // whether the last renewal was stored
  std::optional<uint64_t> seen_;  // sequence of the newest record, while another holds it
  std::string seen_holder_;
  int64_t seen_utime_ = 0;                // when this record was first seen
  std::optional<int64_t> sign_utime_;     // the last sign of life of seen_holder_
  std::optional<int64_t> answers_utime_;  // since when NATS has answered each time
};

}  // namespace pangea

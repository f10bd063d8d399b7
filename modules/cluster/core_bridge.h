#pragma once

// The bridge beside a site's server, role core. It stores the journal in the site's stream, event
// by event (journal_shipper.h), and tells agent_handler how much of it is there, so that it can
// acknowledge that. Place matches that lack results, and results of former runs, go to the workers.
// The workers' results come back as CONSTRAINT, and the options of their verifiers as OPTIONS_*.
// Results that agent_handler asks for (VERDICT_REQUEST) are read from the stream. For
// place_recognition, posegraph and the journal, the bridge replaces inter_map_ba and fusion.
//   server bus: JOURNAL_FILE, HAVE, KEYFRAME_*, PLACE_MATCH, VERDICT_REQUEST, AGAIN_bridge in;
//               JOURNAL_REPLICATED, CONSTRAINT, OPTIONS_*, AGAIN_agent_handler, RESEND_REQUEST,
//               STATUS_bridge out
//
// It runs while it holds the site's lease. When another core has begun, it throws LeaseLost.
//
// At the start it learns from the journal which matches and results it has to store. While NATS
// does not answer, at most kMaxUnstored messages wait; beyond that the process ends with an error,
// and learns them from the journal again at its next start. Not thread safe.

#include <cstdint>
#include <deque>
#include <set>
#include <utility>

#include "bus/node.h"
#include "bus/process.h"
#include "cluster/journal_shipper.h"
#include "cluster/site_lease.h"
#include "cluster/site_streams.h"
#include "cluster/stream_watch.h"
#include "core/server_messages.h"
#include "journal_follower/journal_follower.h"
#include "messages/catch_up_messages.h"

namespace pangea {

class CoreBridge : public Process {
 public:
  // `lease` must be held. Throws LeaseLost, or std::runtime_error when NATS does not answer.
  CoreBridge(Bus& bus, SiteStreams& streams, SiteLease& lease);

  void Tick(int64_t now_utime) override;
  void BetweenMessages(int64_t now_utime) override;
  int longest_wait_ms() const override { return results_watch_.longest_wait_ms(now_utime_); }

 private:
  static constexpr size_t kMaxUnstored = 5000;
  // Messages handled at once, so that the bus does not wait for long. It is more than a piece of
  // the journal's file has.
  static constexpr int kPiece = 500;
  // Interval at which JOURNAL_REPLICATED is repeated for agent_handler.
  static constexpr int64_t kToldInterval_us = 250'000;

  void OnJournalFile(const JournalFile& file);
  void ShipJournal();
  void ToStore(SiteStreams::Entry entry);
  bool TakeMatch(const PlaceMatch& match);
  void OnFormerResult(const Constraint& result);
  void OnVerificationRequest(const VerificationRequest& request);
  void StoreAll();
  void PublishResults();
  void PublishOptions();
  void AnswerRequests();
  void PublishStatus(int64_t now_utime);

  Node node_;
  SiteStreams& streams_;
  SiteLease& lease_;
  JournalShipper shipper_;
  JournalFollower journal_;
  SiteStreams::Reader results_;
  StreamWatch results_watch_;
  std::deque<SiteStreams::Entry> to_store_;
  std::set<int64_t> in_journal_;                      // constraint ids
  std::deque<std::pair<KeyframeId, int64_t>> asked_;  // query and constraint id
  int64_t now_utime_ = 0;
  int64_t told_bytes_ = -1;  // replicated bytes of the journal, as last told
  int64_t next_told_utime_ = 0;
  int64_t next_poll_utime_ = 0;
};

}  // namespace pangea

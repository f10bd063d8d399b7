#pragma once

// The bridge beside a site's server, role core. The journal goes into the site's stream, event by
// event (journal_shipper.h), and agent_handler is told how much of it is there: only then it
// acknowledges. Place matches that lack results go to workers, and so do results of former runs.
// The workers' results come back as CONSTRAINT, those that agent_handler asks for
// (VERDICT_REQUEST) out of the stream, the options of their verifiers as OPTIONS_*. To
// place_recognition, posegraph and the journal it is what inter_map_ba and fusion are.
//   server bus: JOURNAL_FILE, HAVE, KEYFRAME_*, PLACE_MATCH, VERDICT_REQUEST, AGAIN_bridge in;
//               JOURNAL_REPLICATED, CONSTRAINT, OPTIONS_*, AGAIN_agent_handler, RESEND_REQUEST,
//               STATUS_bridge out
//
// It is there while it holds the site's lease; when another core has begun it ends by LeaseLost.
//
// At a start the journal says which matches and results are to be stored. While NATS does not
// answer these wait, at most kMaxUnstored messages; beyond that the process ends with an error, and
// has it all again from the journal when it is started again. One thread.

#include <cstdint>
#include <deque>
#include <set>
#include <utility>

#include "bus/node.h"
#include "bus/process.h"
#include "bus/retransmission/journal_follower.h"
#include "cluster/journal_shipper.h"
#include "cluster/site_lease.h"
#include "cluster/site_streams.h"
#include "core/server_messages.h"
#include "messages/catch_up_messages.h"

namespace pangea {

class CoreBridge : public Process {
 public:
  // The lease is held. Throws LeaseLost, and std::runtime_error when NATS does not answer.
  CoreBridge(Bus& bus, SiteStreams& streams, SiteLease& lease);

  void Tick(int64_t now_utime) override;
  void BetweenMessages(int64_t now_utime) override;
  int longest_wait_ms() const override { return 20; }

 private:
  static constexpr size_t kMaxUnstored = 5000;
  // In one go, so that messages on the bus do not wait long; more than a piece of the journal's
  // file has.
  static constexpr int kPiece = 500;
  // By then agent_handler hears again of what is replicated.
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
  std::deque<SiteStreams::Entry> to_store_;
  std::set<int64_t> in_journal_;                      // constraint ids
  std::deque<std::pair<KeyframeId, int64_t>> asked_;  // query and constraint id
  int64_t now_utime_ = 0;
  int64_t told_bytes_ = -1;  // of the journal, that are replicated
  int64_t next_told_utime_ = 0;
  int64_t next_poll_utime_ = 0;
  int64_t next_status_utime_ = 0;
};

}  // namespace pangea

#pragma once

// The bridge beside a site's server, role core. What the journal has and gets goes into the site's
// streams: keyframes, verification results, and the place matches that lack results, for workers.
// The workers' results come back as CONSTRAINT; those that agent_handler asks for (VERDICT_REQUEST)
// are answered out of the stream. To place_recognition, posegraph and the journal it is what
// inter_map_ba and fusion are.
//   server bus: JOURNAL_FILE, HAVE, KEYFRAME_*, PLACE_MATCH, VERDICT_REQUEST, AGAIN_bridge in;
//               CONSTRAINT, AGAIN_agent_handler, RESEND_REQUEST, STATUS_bridge out
//
// Nothing is remembered between runs: at a start the journal says what is to be stored, and which
// results it has. While NATS does not answer, what is to be stored waits, at most kMaxUnstored
// messages; beyond that the process ends with an error, and has it all again from the journal when
// it is started again. One thread.

#include <cstdint>
#include <deque>
#include <set>
#include <utility>

#include "bus/node.h"
#include "bus/process.h"
#include "bus/retransmission/journal_follower.h"
#include "cluster/site_streams.h"
#include "core/server_messages.h"
#include "messages/catch_up_messages.h"

namespace pangea {

class CoreBridge : public Process {
 public:
  CoreBridge(Bus& bus, SiteStreams& streams);

  void Tick(int64_t now_utime) override;
  void BetweenMessages(int64_t now_utime) override;
  int longest_wait_ms() const override { return 20; }

 private:
  static constexpr size_t kMaxUnstored = 5000;
  // In one go, so that messages on the bus do not wait long; more than a piece of the journal's
  // file has.
  static constexpr int kPiece = 500;

  void ToStore(SiteStreams::Entry entry);
  bool TakeMatch(const PlaceMatch& match);
  void OnFormerResult(const Constraint& result);
  void OnVerificationRequest(const VerificationRequest& request);
  void StoreAll();
  void PublishResults();
  void AnswerRequests();
  void PublishStatus(int64_t now_utime);

  Node node_;
  SiteStreams& streams_;
  JournalFollower journal_;
  SiteStreams::Reader results_;
  std::deque<SiteStreams::Entry> to_store_;
  std::set<int64_t> in_journal_;                      // constraint ids
  std::deque<std::pair<KeyframeId, int64_t>> asked_;  // query and constraint id
  int64_t next_poll_utime_ = 0;
  int64_t next_status_utime_ = 0;
};

}  // namespace pangea

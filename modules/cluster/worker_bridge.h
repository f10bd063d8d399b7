#pragma once

// The bridge on a worker host, role worker: on a bus of its own with pangea-fusion and
// pangea-inter-map-ba, to which it is agent_handler. Keyframes of the site's stream and HAVE go
// onto the bus; it takes at most `max_matches` matches at a time from the queue, publishes them,
// stores the results, and acknowledges a match once all its results are stored. Results of other
// workers are passed on to the verifiers as those of former runs are. A match goes back into the
// queue while results that its candidates rest on (core/candidates/candidate_order.h) are still to
// come, for 15 s at most: so the map is the same however many workers there are.
//   bus: CONSTRAINT, OPTIONS_*, RESEND_REQUEST, AGAIN_agent_handler in;
//        KEYFRAME_*, PLACE_MATCH, HAVE, VERDICT_REQUEST, AGAIN_<process>, STATUS_bridge out
//
// A result that got lost on the bus is asked for, and its match published again: a verifier takes
// a match once and repeats what it has made. Requests for matches are not answered: a verifier asks
// for those of all maps, and most are other workers'. A match of a worker that dies comes to
// another. One thread.

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bus/node.h"
#include "bus/process.h"
#include "cluster/outstanding_matches.h"
#include "cluster/pending_matches.h"
#include "cluster/site_streams.h"
#include "messages/catch_up_messages.h"
#include "pangea/again_t.hpp"

namespace pangea {

class WorkerBridge : public Process {
 public:
  WorkerBridge(Bus& bus, SiteStreams& streams, size_t max_matches);
  ~WorkerBridge() override;  // gives back what it has not finished
  WorkerBridge(const WorkerBridge&) = delete;
  WorkerBridge& operator=(const WorkerBridge&) = delete;

  void Tick(int64_t now_utime) override;
  void BetweenMessages(int64_t now_utime) override;
  int longest_wait_ms() const override { return 20; }

 private:
  // In one round, of which there are kRoundInterval_us between two: what fits receive buffers.
  static constexpr int kKeyframes = 10;
  static constexpr int kResults = 50;
  static constexpr size_t kMaxRequests = 1000;

  // What a verifier asked for: keyframes one by one, or a map's results.
  struct Request {
    std::string requester;
    SeqGap range;
    std::optional<SiteStreams::Reader> results;  // of the map, where these were asked for
  };

  void OnResult(const Constraint& result);
  void OnRetransmission(const again_t& again);
  void OnResendRequest(const ResendRequest& request);
  void PassKeyframes();
  void PassHave();
  void PassResults();
  void StoreResults();
  bool KnowsWhatItRestsOn(const PlaceMatch& match, int64_t now_utime);
  void TakeMatches(int64_t now_utime);
  void TakeMatch(PlaceMatch match, const std::string& ack_subject, int64_t now_utime);
  void NoteStored(int64_t constraint_id);
  void AnswerRequests();
  // Whether there is more to answer.
  bool AnswerKeyframe(Request* request);
  bool AnswerResult(Request* request);
  void AskForOverdue(int64_t now_utime);
  void PublishStatus(int64_t now_utime);

  Node node_;
  Node as_handler_;  // whom verifiers answer
  SiteStreams& streams_;
  const size_t max_matches_;
  OutstandingMatches outstanding_;
  PendingMatches pending_;
  SiteStreams::Reader keyframes_;
  SiteStreams::Reader results_;
  std::map<int64_t, SiteStreams::Entry> to_store_;  // results by constraint id
  std::vector<std::string> done_;                   // acks that NATS has not yet
  std::deque<Request> requests_;
  bool has_keyframes_ = false;  // all that the stream had
  int64_t next_round_utime_ = 0;
  int64_t next_status_utime_ = 0;
  int64_t num_results_ = 0;
};

}  // namespace pangea

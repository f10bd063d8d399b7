#pragma once

// The bridge on a worker host, role worker. It shares a bus with pangea-fusion and
// pangea-inter-map-ba, and stands for the agent_handler there. It publishes the keyframes of the
// site's stream, and HAVE. It takes at most `max_matches` matches at a time from the queue,
// publishes them, stores their results, and acknowledges a match once all its results are stored.
// It passes results of other workers to the verifiers, as those of former runs. While a match waits
// for earlier results (core/candidates/candidate_order.h), it goes back into the queue, for at most
// 15 s. So the map does not depend on the number of workers.
//   bus: CONSTRAINT, OPTIONS_*, RESEND_REQUEST, AGAIN_agent_handler in;
//        KEYFRAME_*, PLACE_MATCH, HAVE, VERDICT_REQUEST, AGAIN_<process>, STATUS_bridge out
//
// If a result was lost on the bus, it is asked for, and its match is published again; a verifier
// verifies a match only once, and repeats its results. Requests for matches are not answered,
// because verifiers ask for those of all maps, and most of them belong to other workers. If a
// worker dies, its matches go to others. Not thread safe.

#include <algorithm>
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
#include "cluster/stream_watch.h"
#include "messages/catch_up_messages.h"
#include "pangea/again_t.hpp"

namespace pangea {

class WorkerBridge : public Process {
 public:
  WorkerBridge(Bus& bus, SiteStreams& streams, size_t max_matches);
  ~WorkerBridge() override;  // gives unfinished matches back to the queue
  WorkerBridge(const WorkerBridge&) = delete;
  WorkerBridge& operator=(const WorkerBridge&) = delete;

  void Tick(int64_t now_utime) override;
  void BetweenMessages(int64_t now_utime) override;
  int longest_wait_ms() const override {
    return std::min(keyframes_watch_.longest_wait_ms(next_round_utime_),
                    results_watch_.longest_wait_ms(next_round_utime_));
  }

 private:
  // Bounds for one round (one per kRoundInterval_us), so that the messages fit receive buffers.
  static constexpr int kKeyframes = 10;
  static constexpr int kResults = 50;
  static constexpr size_t kMaxRequests = 1000;

  // A verifier's request for keyframes, or for the results of a map.
  struct Request {
    std::string requester;
    SeqGap range;
    std::optional<SiteStreams::Reader> results;  // set for a request for results
  };

  void OnResult(const Constraint& result);
  void OnRetransmission(const again_t& again);
  void OnResendRequest(const ResendRequest& request);
  void ListenToStored(int64_t now_utime);
  void PassKeyframes(int64_t now_utime);
  void PassHave();
  void PassResults(int64_t now_utime);
  void StoreResults();
  bool KnowsWhatItRestsOn(const PlaceMatch& match, int64_t now_utime);
  void TakeMatches(int64_t now_utime);
  void TakeMatch(PlaceMatch match, const std::string& ack_subject, int64_t now_utime);
  void NoteStored(int64_t constraint_id);
  void AnswerRequests();
  // These send the next answer and return whether there is more to send.
  bool AnswerKeyframe(Request* request);
  bool AnswerResult(Request* request);
  void AskForOverdue(int64_t now_utime);
  void PublishStatus(int64_t now_utime);

  Node node_;
  Node as_handler_;  // named agent_handler, to which verifiers answer
  SiteStreams& streams_;
  const size_t max_matches_;
  OutstandingMatches outstanding_;
  PendingMatches pending_;
  SiteStreams::Reader keyframes_;
  SiteStreams::Reader results_;
  StreamWatch keyframes_watch_, results_watch_, matches_watch_;
  int64_t given_back_utime_ = 0;                    // when a match was last given back to wait
  std::map<int64_t, SiteStreams::Entry> to_store_;  // results by constraint id
  std::vector<std::string> done_;                   // ack subjects still to be acknowledged
  std::deque<Request> requests_;
  bool has_keyframes_ = false;  // all keyframes of the stream were once published
  int64_t next_round_utime_ = 0;
  int64_t num_results_ = 0;
};

}  // namespace pangea

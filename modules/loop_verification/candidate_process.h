#pragma once

// The process around a LoopVerifier: KEYFRAME_* and PLACE_MATCH in, CONSTRAINT out, exactly one a
// candidate of its kind. A candidate about a keyframe not seen yet waits for it; what is missing is
// asked for (journal_follower.h). Verification results of this run
// that the journal lacks (VERDICT_REQUEST) are answered to its owner, the agent_handler, which
// everyone else asks; of those that are still to be made nothing is said, they will come. Which
// candidates are redundant depends on the results before; any other verification result on the
// keyframes alone, not on when they came.
//
// A verification result takes long (tens of milliseconds), so live they are made one at a time, in
// the order in which the candidates became ready, when no message waits: all that came is known,
// told as pending and answered for, however far behind the verification results are.
//
// Bounds: at most kMaxWaiting candidates wait; beyond that a match is not taken, and asked for
// again once half of them are verified. The newest kMaxSent verification results are kept to be
// retransmitted.

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "bus/bus.h"
#include "bus/node.h"
#include "bus/process.h"
#include "bus/retransmission/journal_follower.h"
#include "loop_verification/loop_verifier.h"
#include "messages/catch_up_messages.h"

namespace pangea {

class CandidateProcess : public Process {
 public:
  CandidateProcess(Bus& bus, const std::string& name, PlaceKind kind,
                   std::unique_ptr<LoopVerifier> verifier,
                   std::shared_ptr<const RecordStore> records = nullptr);
  void Tick(int64_t now_utime) override;

 private:
  static constexpr size_t kMaxWaiting = 2000;
  static constexpr size_t kMaxSent = 5000;

  bool TakeMatch(const PlaceMatch& match);
  void OnFormerResult(const Constraint& result);
  void OnHave(const Have& have);
  void OnVerificationRequest(const VerificationRequest& request);
  void CollectReady();
  // The first that is ready; whether some are left.
  bool VerifyNext();
  void PublishStatus(int64_t now_utime);
  size_t num_pending() const { return waiting_.size() + ready_.size(); }

  Node node_;
  PlaceKind kind_;
  std::unique_ptr<LoopVerifier> verifier_;
  std::shared_ptr<const RecordStore> records_;  // the verifier's
  JournalFollower journal_;
  // Which wait for keyframes, by (query, match); and with the query, which wait for their turn.
  std::map<std::pair<KeyframeId, KeyframeId>, PlaceCandidate> waiting_;
  std::deque<std::pair<KeyframeId, PlaceCandidate>> ready_;
  std::set<int64_t> verified_;   // constraint ids
  std::deque<Constraint> sent_;  // newest verification results, to repeat
  int64_t next_status_utime_ = 0;
  int64_t num_accepted_ = 0;
};

}  // namespace pangea

#pragma once

// The process around a LoopVerifier. In: KEYFRAME_* and PLACE_MATCH. Out: CONSTRAINT, exactly one
// for each candidate of its kind. A candidate waits for its keyframes; missing ones are requested
// (journal_follower.h). The process answers VERDICT_REQUEST only to the journal's owner, the
// agent_handler, with results of this run that the journal lacks; all others ask the agent_handler.
// It does not answer for results that are still to be computed; they will be published. Whether a
// candidate is redundant depends on earlier results, for which it waits
// (core/candidates/candidate_order.h). Any other result depends only on the keyframes, not on the
// order of arrival.
//
// A verification takes long (tens of milliseconds). Live, candidates are verified one at a time,
// when no message waits: in the order in which they became ready, except that results on which
// another candidate depends come first. So all messages are received, pending candidates are
// counted in the status, and requests are answered, even if verification is far behind.
//
// A checkpoint covers the matches before the first one with a candidate that has no result in the
// journal.
//
// Bounds: at most kMaxWaiting candidates wait; beyond that a match is not accepted, and is
// requested again when half of them are verified. The newest kMaxSent results are kept for
// retransmission.
//
// With several threads, candidates whose turn has not come, but that depend on no pending one, are
// verified together with the next one. Their results wait for their turn (results_ahead_), so what
// is published, and its order, does not depend on the number of threads.

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
#include "core/candidates/candidate_order.h"
#include "journal_follower/journal_follower.h"
#include "loop_verification/alignment_threads.h"
#include "loop_verification/loop_verifier.h"
#include "messages/catch_up_messages.h"

namespace pangea {

class CandidateProcess : public Process {
 public:
  // `records`: stores keyframes that come over the bus; may be null.
  CandidateProcess(Bus& bus, const std::string& name, PlaceKind kind,
                   const LoopVerifierOptions& options, const std::shared_ptr<RecordStore>& records,
                   const CheckpointPlace& checkpoint, int threads);
  void Tick(int64_t now_utime) override;

 private:
  static constexpr size_t kMaxWaiting = 2000;
  static constexpr size_t kMaxSent = 5000;

  // Candidates by a tag go to fusion, also those within one map.
  bool IsMine(PlaceKind kind) const {
    return kind == kind_ || (kind == PlaceKind::kTag && kind_ == PlaceKind::kInter);
  }
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);
  bool IsComplete(const PlaceMatch& match) const;
  bool TakeMatch(const PlaceMatch& match);
  void OnFormerResult(const Constraint& result);
  void OnHave(const Have& have);
  void OnVerificationRequest(const VerificationRequest& request);
  void CollectReady();
  using Ready = std::pair<KeyframeId, PlaceCandidate>;  // (query, candidate)
  PendingQueries Pending() const;
  std::deque<Ready>::iterator NextReady();
  // Adds the result of the candidate, and perhaps of others, to results_ahead_.
  void Verify(std::deque<Ready>::iterator next);
  void ForgetAhead(const KeyframeId& query);
  // Returns whether another candidate may be ready.
  bool VerifyNext();
  void Take(const Constraint& constraint);
  void PublishStatus(int64_t now_utime);
  size_t num_pending() const { return waiting_.size() + ready_.size(); }

  Node node_;
  PlaceKind kind_;
  std::shared_ptr<JournalRecords> records_;
  LoopVerifier verifier_;
  AlignmentThreads threads_;
  JournalFollower journal_;
  // Candidates that wait for keyframes, by (query, match); and candidates that wait for their turn.
  std::map<std::pair<KeyframeId, KeyframeId>, PlaceCandidate> waiting_;
  std::deque<Ready> ready_;
  std::map<std::pair<KeyframeId, KeyframeId>, Constraint> results_ahead_;  // by (query, match)
  std::set<int64_t> verified_;                                             // constraint ids
  std::deque<Constraint> sent_;  // newest results, for retransmission
  int64_t num_accepted_ = 0;
};

}  // namespace pangea

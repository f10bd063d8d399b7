#pragma once

// The process around a LoopVerifier: KEYFRAME_* and PLACE_MATCH in, CONSTRAINT out, exactly one a
// candidate of its kind. A candidate about a keyframe not seen yet waits for it; what is missing is
// asked for (journal_follower.h). Verification results of this run
// that the journal lacks (VERDICT_REQUEST) are answered to its owner, the agent_handler, which
// everyone else asks; of those that are still to be made nothing is said, they will come. Which
// candidates are redundant depends on the results that they rest on
// (core/candidates/candidate_order.h) and wait for; any other verification result on the keyframes
// alone, not on when they came.
//
// A verification result takes long (tens of milliseconds), so live they are made one at a time, in
// the order in which the candidates became ready but for what they rest on, when no message waits:
// all that came is known, told as pending and answered for, however far behind the verification
// results are.
//
// A checkpoint ends before the first match with a candidate that has no result in the journal.
//
// Bounds: at most kMaxWaiting candidates wait; beyond that a match is not taken, and asked for
// again once half of them are verified. The newest kMaxSent verification results are kept to be
// retransmitted.

#include <cstdint>
#include <deque>
#include <functional>
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
  using MakeVerifier =
      std::function<std::unique_ptr<LoopVerifier>(const std::shared_ptr<RecordStore>& records)>;

  // `records`: for keyframes that come over the bus; may be null.
  CandidateProcess(Bus& bus, const std::string& name, PlaceKind kind,
                   const MakeVerifier& make_verifier, const std::shared_ptr<RecordStore>& records,
                   const CheckpointPlace& checkpoint);
  void Tick(int64_t now_utime) override;

 private:
  static constexpr size_t kMaxWaiting = 2000;
  static constexpr size_t kMaxSent = 5000;

  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);
  bool IsComplete(const PlaceMatch& match) const;
  bool TakeMatch(const PlaceMatch& match);
  void OnFormerResult(const Constraint& result);
  void OnHave(const Have& have);
  void OnVerificationRequest(const VerificationRequest& request);
  void CollectReady();
  using Ready = std::pair<KeyframeId, PlaceCandidate>;  // with its query
  std::deque<Ready>::iterator NextReady();
  // Whether there may be another.
  bool VerifyNext();
  void PublishStatus(int64_t now_utime);
  size_t num_pending() const { return waiting_.size() + ready_.size(); }

  Node node_;
  PlaceKind kind_;
  std::shared_ptr<JournalRecords> records_;
  std::unique_ptr<LoopVerifier> verifier_;
  JournalFollower journal_;
  // Which wait for keyframes, by (query, match); and which wait for their turn.
  std::map<std::pair<KeyframeId, KeyframeId>, PlaceCandidate> waiting_;
  std::deque<Ready> ready_;
  std::set<int64_t> verified_;   // constraint ids
  std::deque<Constraint> sent_;  // newest verification results, to repeat
  int64_t next_status_utime_ = 0;
  int64_t num_accepted_ = 0;
};

}  // namespace pangea

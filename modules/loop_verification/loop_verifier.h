#pragma once

// The core of inter_map_ba and fusion: keyframes in, one verification result per candidate out. A
// candidate that would add little information is refused as redundant (known_constraints.h). Any
// other result depends only on the two keyframes, on their neighbours and, within one map, on the
// odometry between them; so it does not depend on the order of arrival. Not thread safe.

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/keyframe_store.h"
#include "loop_verification/aligner.h"
#include "loop_verification/drift_gate.h"
#include "loop_verification/known_constraints.h"

namespace pangea {

struct LoopVerifierOptions {
  LoopVerificationOptions alignment;
  // Only for candidates within one map.
  DriftGateOptions drift;
  KnownConstraintOptions redundancy;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("alignment", &alignment, "verification of a candidate, step by step");
    archive.Section("drift", &drift,
                    "the odometry's drift that a constraint within one map may claim");
    archive.Section("redundancy", &redundancy, "candidates that the map knows already");
  }
};

// A candidate with all that its verification needs.
struct VerificationTask {
  PlaceCandidate candidate;
  CandidateKeyframes keyframes;
  std::optional<DriftGate> drift_gate;  // only within one map

  Constraint Run(Aligner* aligner, LoopVerificationReport* report = nullptr) const {
    return aligner->Align(keyframes, candidate, drift_gate, report);
  }
};

class LoopVerifier {
 public:
  // `records`: stores keyframes (keyframe_store.h); null: they stay in memory. Throws
  // std::runtime_error when the options of tags are wrong.
  explicit LoopVerifier(const LoopVerifierOptions& options,
                        std::shared_ptr<RecordStore> records = nullptr)
      : drift_(options.drift),
        aligner_(options.alignment),
        known_(options.redundancy),
        store_({}, std::move(records)) {
    [[maybe_unused]] const TagSizes checked(options.alignment.tags);
  }

  // Keyframes may come in any order; a repeat is ignored.
  void Add(Keyframe keyframe) { store_.Add(std::move(keyframe)); }
  // These keyframes are lost for good: candidates no longer wait for them.
  void NoteLost(const MapId& map, int32_t from_seq, int32_t to_seq) {
    store_.NoteLost(map, from_seq, to_seq);
  }
  // Adds a verification result, of this or a former run.
  void NoteVerified(const Constraint& result);
  // Whether all keyframes that the verification needs are here, or lost.
  bool Ready(const KeyframeId& query, const PlaceCandidate& candidate) const;
  // Prepare, the task's Run, and NoteVerified in one. Call only if Ready.
  Constraint Verify(const KeyframeId& query, const PlaceCandidate& candidate,
                    LoopVerificationReport* report = nullptr);
  // The part of Verify that uses this object: the task, or the result if none is needed. Tasks can
  // run on several threads, each with an aligner of its own. Call only if Ready.
  std::variant<VerificationTask, Constraint> Prepare(const KeyframeId& query,
                                                     const PlaceCandidate& candidate);

  // The record of a keyframe, as it is stored in `records`.
  static std::vector<uint8_t> RecordOf(const Keyframe& keyframe) {
    return KeyframeStore::RecordOf(keyframe, {});
  }
  // Saves the keyframes and known constraints. Restore returns false, and changes nothing, if the
  // bytes are not those of a LoopVerifier.
  void Save(ByteWriter* writer) const;
  bool Restore(ByteReader* reader);

  const RecordCounters& store_counters() const { return store_.counters(); }

 private:
  // Fills in the keyframes and, within one map, the drift gate; else returns the reason.
  std::string Complete(const KeyframeId& query, VerificationTask* task);

  DriftGateOptions drift_;
  Aligner aligner_;
  KnownConstraints known_;
  KeyframeStore store_;
};

// A refused constraint without a pose.
Constraint RefusedConstraint(const KeyframeId& query, const PlaceCandidate& candidate,
                             const std::string& reason);

}  // namespace pangea

#pragma once

// The core of inter_map_ba and fusion: keyframes in, one verification result per candidate out. A
// candidate that would add little information is refused as redundant (known_constraints.h). Any
// other result depends only on the two keyframes, on their neighbours and, within one map, on the
// odometry between them; so it does not depend on the order of arrival. Not thread safe.

#include <memory>
#include <string>
#include <utility>
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

class LoopVerifier {
 public:
  // `records`: stores keyframes (keyframe_store.h); null: they stay in memory.
  explicit LoopVerifier(const LoopVerifierOptions& options,
                        std::shared_ptr<RecordStore> records = nullptr)
      : drift_(options.drift),
        aligner_(options.alignment),
        known_(options.redundancy),
        store_({}, std::move(records)) {}

  // Keyframes may come in any order; a repeat is ignored.
  void Add(Keyframe keyframe) { store_.Add(std::move(keyframe)); }
  // These keyframes are lost for good: candidates no longer wait for them.
  void NoteLost(const MapId& map, int32_t from_seq, int32_t to_seq) {
    store_.NoteLost(map, from_seq, to_seq);
  }
  // Adds a verification result of a former run.
  void NoteVerified(const Constraint& result);
  // Whether all keyframes that the verification needs are here, or lost.
  bool Ready(const KeyframeId& query, const PlaceCandidate& candidate) const;
  // Call only if Ready. Two keyframes of one map must also pass the drift gate.
  Constraint Verify(const KeyframeId& query, const PlaceCandidate& candidate,
                    LoopVerificationReport* report = nullptr);

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
  Constraint Align(const KeyframeId& query, const PlaceCandidate& candidate,
                   LoopVerificationReport* report);

  DriftGateOptions drift_;
  Aligner aligner_;
  KnownConstraints known_;
  KeyframeStore store_;
};

// A refused constraint without a pose.
Constraint RefusedConstraint(const KeyframeId& query, const PlaceCandidate& candidate,
                             const std::string& reason);

}  // namespace pangea

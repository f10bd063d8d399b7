#pragma once

// The core that inter_map_ba and fusion build on: keyframes in, one verification result a candidate
// out. What the map knows already is refused as redundant (known_constraints.h). Any other
// verification result depends on the two keyframes, those just before each and, within one
// map, the odometry edges between them; so it is the same whatever the order of arrival. Not thread
// safe.

#include <memory>
#include <string>
#include <utility>

#include "core/submap_store.h"
#include "loop_verification/aligner.h"
#include "loop_verification/drift_gate.h"
#include "loop_verification/known_constraints.h"

namespace pangea {

struct LoopVerifierOptions {
  LoopVerificationOptions alignment;
  // For a candidate within one map.
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
  // `records`: for keyframes (submap_store.h).
  explicit LoopVerifier(const LoopVerifierOptions& options,
                        std::shared_ptr<RecordStore> records = nullptr)
      : drift_(options.drift),
        aligner_(options.alignment),
        known_(options.redundancy),
        store_({}, std::move(records)) {}
  virtual ~LoopVerifier() = default;

  // In any order; a repeat changes nothing.
  void Add(Keyframe keyframe) { store_.Add(std::move(keyframe)); }
  // Nobody has these any more: nothing waits for them.
  void NoteLost(const MapId& map, int32_t from_seq, int32_t to_seq) {
    store_.NoteLost(map, from_seq, to_seq);
  }
  // A verification result of a former run.
  void NoteVerified(const Constraint& result);
  // Whether every keyframe the verification result depends on is there.
  bool Ready(const KeyframeId& query, const PlaceCandidate& candidate) const;
  // Only when ready. Keyframes of one map pass the drift gate too; two maps' odom frames lie
  // anyhow to each other.
  virtual Constraint Verify(const KeyframeId& query, const PlaceCandidate& candidate,
                            LoopVerificationReport* report = nullptr);

  const RecordCounters& store_counters() const { return store_.counters(); }

 private:
  Constraint Align(const KeyframeId& query, const PlaceCandidate& candidate,
                   LoopVerificationReport* report);

  DriftGateOptions drift_;
  Aligner aligner_;
  KnownConstraints known_;
  SubmapStore store_;
};

// A verification result without an alignment.
Constraint RefusedConstraint(const KeyframeId& query, const PlaceCandidate& candidate,
                             const std::string& reason);

}  // namespace pangea

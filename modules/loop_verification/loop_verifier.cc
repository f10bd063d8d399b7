#include "loop_verification/loop_verifier.h"

#include <utility>

namespace pangea {
namespace {

constexpr int kKeyframesBehind = 4;

}  // namespace

Constraint RefusedConstraint(const KeyframeId& query, const PlaceCandidate& candidate,
                             const std::string& reason) {
  Constraint constraint;
  constraint.from = candidate.match;
  constraint.to = query;
  constraint.kind = candidate.kind;
  constraint.reason = reason;
  return constraint;
}

bool LoopVerifier::Ready(const KeyframeId& query, const PlaceCandidate& candidate) const {
  if (!store_.WindowIsComplete(query, Aligner::kNumKeyframes) ||
      !store_.WindowIsComplete(candidate.match, Aligner::kNumKeyframes)) {
    return false;
  }
  return query.map != candidate.match.map || store_.ChainIsComplete(candidate.match, query);
}

void LoopVerifier::NoteVerified(const Constraint& result) {
  if (result.accepted) {
    known_.Add(result);
  }
}

void LoopVerifier::Save(ByteWriter* writer) const {
  known_.Save(writer);
  store_.Save(writer);
}

bool LoopVerifier::Restore(ByteReader* reader) {
  KnownConstraints known = known_;
  known.Restore(reader);
  if (!store_.Restore(reader)) {
    return false;
  }
  known_ = std::move(known);
  return true;
}

Constraint LoopVerifier::Verify(const KeyframeId& query, const PlaceCandidate& candidate,
                                LoopVerificationReport* report) {
  const auto prepared = Prepare(query, candidate);
  if (const auto* refused = std::get_if<Constraint>(&prepared)) {
    return *refused;
  }
  Constraint result = std::get<VerificationTask>(prepared).Run(&aligner_, report);
  NoteVerified(result);
  return result;
}

std::variant<VerificationTask, Constraint> LoopVerifier::Prepare(const KeyframeId& query,
                                                                 const PlaceCandidate& candidate) {
  if (candidate.kind == PlaceKind::kIntra && query.map != candidate.match.map) {
    return RefusedConstraint(query, candidate, "intra, but of two maps");
  }
  if (known_.IsRedundant(query, candidate.match, store_)) {
    return RefusedConstraint(query, candidate, kRedundant);
  }
  VerificationTask task;
  task.candidate = candidate;
  if (const std::string reason = Complete(query, &task); !reason.empty()) {
    return RefusedConstraint(query, candidate, reason);
  }
  return task;
}

std::string LoopVerifier::Complete(const KeyframeId& query, VerificationTask* task) {
  const PlaceCandidate& candidate = task->candidate;
  CandidateKeyframes& keyframes = task->keyframes;
  keyframes.m = store_.WindowUpTo(candidate.match, Aligner::kNumKeyframes);
  keyframes.c = store_.WindowUpTo(query, Aligner::kNumKeyframes);
  if (keyframes.m.empty() || keyframes.c.empty()) {
    return "a keyframe was lost";
  }
  for (const auto& [corner_c, corner_m] : candidate.corner_matches) {
    if (corner_c >= static_cast<int>(keyframes.c.back()->keyframe().corners.size()) ||
        corner_m >= static_cast<int>(keyframes.m.back()->keyframe().corners.size())) {
      return "a matched corner does not exist";
    }
  }
  if (query.map == candidate.match.map) {
    if (keyframes.c.front()->keyframe().id.seq <= candidate.match.seq) {
      return "the two keyframes are neighbours";
    }
    const auto path_m = store_.PathBetween(candidate.match, query);
    if (!path_m) {
      return "no odometry leads from one to the other";
    }
    // Only within one map: of another map they may not have arrived, and the result must not depend
    // on that.
    keyframes.after_m = store_.WindowBehind(candidate.match, kKeyframesBehind);
    task->drift_gate.emplace(drift_, *path_m, keyframes.c.back()->keyframe().T_odom_body.t);
  }
  return {};
}

}  // namespace pangea

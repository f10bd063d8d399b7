#include "loop_verification/loop_verifier.h"

namespace pangea {

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
  if (!store_.WindowIsComplete(query, aligner_.num_keyframes()) ||
      !store_.WindowIsComplete(candidate.match, aligner_.num_keyframes())) {
    return false;
  }
  return query.map != candidate.match.map || store_.ChainIsComplete(candidate.match, query);
}

void LoopVerifier::NoteVerified(const Constraint& result) {
  if (result.accepted) {
    known_.Add(result);
  }
}

Constraint LoopVerifier::Verify(const KeyframeId& query, const PlaceCandidate& candidate,
                                LoopVerificationReport* report) {
  if (known_.IsRedundant(query, candidate.match, store_)) {
    return RefusedConstraint(query, candidate, kRedundant);
  }
  Constraint result = Align(query, candidate, report);
  NoteVerified(result);
  return result;
}

Constraint LoopVerifier::Align(const KeyframeId& query, const PlaceCandidate& candidate,
                               LoopVerificationReport* report) {
  const KeyframeWindow frames_c = store_.WindowUpTo(query, aligner_.num_keyframes());
  const KeyframeWindow frames_m = store_.WindowUpTo(candidate.match, aligner_.num_keyframes());
  if (frames_c.empty() || frames_m.empty()) {
    return RefusedConstraint(query, candidate, "a keyframe was lost");
  }
  for (const auto& [corner_c, corner_m] : candidate.corner_matches) {
    if (corner_c >= static_cast<int>(frames_c.back()->keyframe().corners.size()) ||
        corner_m >= static_cast<int>(frames_m.back()->keyframe().corners.size())) {
      return RefusedConstraint(query, candidate, "a matched corner does not exist");
    }
  }
  LoopVerificationGate gate = [](const Rigid3&) { return std::string(); };
  if (query.map == candidate.match.map) {
    if (frames_c.front()->keyframe().id.seq <= candidate.match.seq) {
      return RefusedConstraint(query, candidate, "the two keyframes are neighbours");
    }
    const auto path_m = store_.PathBetween(candidate.match, query);
    if (!path_m) {
      return RefusedConstraint(query, candidate, "no odometry leads from one to the other");
    }
    gate = MakeDriftGate(drift_, *path_m, frames_c.back()->keyframe().T_odom_body.t);
  }
  return aligner_.Align(frames_m, frames_c, candidate, gate, report);
}

}  // namespace pangea

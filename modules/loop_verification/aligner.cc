#include "loop_verification/aligner.h"

#include <cmath>
#include <span>
#include <utility>

#include "loop_verification/extrinsics_error.h"

namespace pangea {
namespace {

// Minimum tilt sigma of each odometry while the first pose is searched, radians.
constexpr double kGuessTiltFloor = 0.006;

void FillIn(const Verification& verification, Constraint* constraint) {
  if (const auto& ba = verification.ba) {
    constraint->T_from_to = ba->T_Km_Kc;
    const auto& [m, c] = verification.windows;
    constraint->covariance =
        ba->covariance +
        ExtrinsicsCovariance(m.newest_keyframe(), c.newest_keyframe(), ba->T_Km_Kc);
    constraint->num_inliers = ba->num_inlier_observations;
    constraint->inlier_ratio = verification.inlier_ratio();
    constraint->rms_px = ba->rms_px;
  }
}

void ShowMatches(const Verification& v, LoopVerificationReport* report) {
  std::vector<bool> inlier(v.first_matches.size(), false);
  for (const int i : v.pnp ? v.pnp->inliers : std::vector<int>()) {
    inlier[i] = true;
  }
  const Rigid3 guess = v.pnp ? v.pnp->pose.T_m_c : Rigid3();
  report->first = Shown(v.windows, v.first_matches, inlier, guess, guess);
  if (v.ba) {
    report->found = Shown(v.windows, v.matches, v.ba->inlier, guess, v.ba->T_m_c);
  }
}

}  // namespace

Constraint Aligner::Align(const CandidateKeyframes& keyframes, const PlaceCandidate& candidate,
                          const std::optional<DriftGate>& drift_gate,
                          LoopVerificationReport* report) {
  Verification verification(options_, keyframes, candidate, drift_gate, &windows_);
  verification.guess_tilt_sigma = std::sqrt(TiltVariance(verification.windows, kGuessTiltFloor));
  Constraint constraint;
  constraint.from = candidate.match;
  constraint.to = keyframes.c.back()->keyframe().id;
  constraint.kind = candidate.kind;
  using Steps = std::span<const VerificationStep>;
  for (const VerificationStep& step :
       candidate.kind == PlaceKind::kTag ? Steps(kTagSteps) : Steps(kVerificationSteps)) {
    verification.step = step.name;
    constraint.reason = step.run(options_, &verification);
    if (!constraint.reason.empty()) {
      verification.report.refused_by = step.name;
      break;
    }
  }
  constraint.accepted = constraint.reason.empty();
  FillIn(verification, &constraint);
  if (report != nullptr) {
    *report = std::move(verification.report);
    ShowMatches(verification, report);
  }
  return constraint;
}

}  // namespace pangea

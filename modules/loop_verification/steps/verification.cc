#include "loop_verification/steps/verification.h"

#include <algorithm>
#include <cmath>

namespace pangea {

double LoopVerificationReport::Measured(std::string_view option) const {
  const auto last = std::find_if(measured.rbegin(), measured.rend(),
                                 [&](const Measurement& m) { return m.option == option; });
  return last == measured.rend() ? 0 : last->value;
}

Verification::Verification(const CommonStepOptions& options, const CandidateKeyframes& keyframes,
                           const PlaceCandidate& candidate,
                           const std::optional<DriftGate>& drift_gate, WindowCache* window_cache)
    : options(options),
      keyframes(keyframes),
      candidate(candidate),
      drift_gate(drift_gate),
      window_cache(*window_cache),
      window_m(window_cache->Make(LastOfWindow(keyframes.m), options.window, keyframes.after_m)),
      window_c(window_cache->Make(LastOfWindow(keyframes.c), options.window)),
      windows{*window_m, *window_c} {}

bool Verification::AtLeast(std::string_view option, double value, double limit) {
  report.measured.push_back({step, option, value, true, limit});
  return !(value < limit);
}

bool Verification::AtMost(std::string_view option, double value, double limit) {
  report.measured.push_back({step, option, value, false, limit});
  return !(value > limit);
}

std::vector<PointObservation> Verification::Observations(const std::vector<PointMatch>& of) const {
  std::vector<PointObservation> observations;
  observations.reserve(of.size());
  for (const PointMatch& match : of) {
    observations.push_back(MakeObservation(windows, match, kCornerSigma_px));
  }
  return observations;
}

double Verification::inlier_ratio() const {
  return matches.empty() ? 1
                         : static_cast<double>(ba->num_inlier_observations) /
                               static_cast<double>(matches.size());
}

std::vector<PointMatch> Verification::InlierMatches() const {
  std::vector<PointMatch> inliers;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (ba->inlier[i]) {
      inliers.push_back(matches[i]);
    }
  }
  return inliers;
}

std::string CheckDrift(const CommonStepOptions& /*options*/, Verification* verification) {
  if (!verification->drift_gate) {
    return "";
  }
  const auto& [m, c] = verification->windows;
  // A window frame is the odom frame, shifted to the newest keyframe's body.
  const Rigid3 T_odom_m(Eigen::Quaterniond::Identity(), m.newest_keyframe().T_odom_body.t);
  const Rigid3 T_odom_c(Eigen::Quaterniond::Identity(), c.newest_keyframe().T_odom_body.t);
  return verification->drift_gate->Check(T_odom_m * verification->T_m_c() * T_odom_c.Inverse());
}

}  // namespace pangea

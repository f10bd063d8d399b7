#pragma once

// The state of one candidate in the steps (steps.h): their common input and their results.

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/server_messages.h"
#include "loop_verification/correspondences/match_sets.h"
#include "loop_verification/correspondences/projection_search.h"
#include "loop_verification/drift_gate.h"
#include "loop_verification/joint_ba/joint_ba.h"
#include "loop_verification/upright_pnp.h"
#include "loop_verification/window.h"
#include "loop_verification/window_cache.h"

namespace pangea {

// Options that several steps use.
struct CommonStepOptions {
  WindowOptions window;
  JointBaOptions ba;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("window", &window, "the local windows that are aligned");
    archive.Section("ba", &ba, "joint bundle adjustment of both windows");
  }
};

// A value that a step compares with a limit.
struct Measurement {
  std::string_view step;    // its name in kVerificationSteps
  std::string_view option;  // the limit's name
  double value = 0;
  bool at_least = false;  // true: value >= limit is required; false: value <= limit
  double limit = 0;
};

// Details of a verification beside its result: for tests, for tuning the options, and for people.
struct LoopVerificationReport {
  std::string_view refused_by;        // name of the refusing step
  std::vector<Measurement> measured;  // in the order of the steps
  std::vector<ShownMatch> first;      // candidate's matches and nearest descriptors; inliers of PnP
  std::vector<ShownMatch> found;      // by projection, in the two keyframes; inliers of BA

  // The last value compared with this limit; 0 if no step has compared one.
  double Measured(std::string_view option) const;
};

// The keyframes for a verification. They reach further back than the windows.
struct CandidateKeyframes {
  KeyframeWindow m;        // ends with the match
  KeyframeWindow c;        // ends with the query
  KeyframeWindow after_m;  // following the match: help to triangulate its corners
};

struct Verification {
  Verification(const CommonStepOptions& options, const CandidateKeyframes& keyframes,
               const PlaceCandidate& candidate, const std::optional<DriftGate>& drift_gate,
               WindowCache* window_cache);

  const CommonStepOptions& options;
  const CandidateKeyframes& keyframes;
  const PlaceCandidate& candidate;
  const std::optional<DriftGate>& drift_gate;  // only within one map
  WindowCache& window_cache;
  std::shared_ptr<const Window> window_m, window_c;
  WindowPair windows;
  double guess_tilt_sigma = 0;  // radians, of roll and pitch between the windows

  std::vector<PointMatch> first_matches;
  std::optional<UprightPnpResult> pnp;
  PoseEstimate pose;                // the current estimate, before the bundle adjustment
  std::vector<PointMatch> matches;  // used by the BA
  std::optional<JointBaResult> ba;
  std::string_view step;  // name of the running step
  LoopVerificationReport report;

  // Whether the value meets the limit; also records it in the report.
  bool AtLeast(std::string_view option, double value, double limit);
  bool AtMost(std::string_view option, double value, double limit);

  std::vector<PointObservation> Observations(const std::vector<PointMatch>& of) const;
  // The present alignment of the windows: the adjusted one, once there is one.
  const Rigid3& T_m_c() const { return ba ? ba->T_m_c : pose.T_m_c; }
  // Share of inliers among the matches that the BA used; 1 if tags alone were used.
  double inlier_ratio() const;
  std::vector<PointMatch> InlierMatches() const;
};

// Applies the drift gate, if there is one, to the present alignment of the two odom frames.
std::string CheckDrift(const CommonStepOptions& options, Verification* verification);

}  // namespace pangea

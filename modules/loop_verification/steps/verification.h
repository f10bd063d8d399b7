#pragma once

// One candidate on its way through the steps (steps.h): what they are given, and what they hand on.

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/server_messages.h"
#include "loop_verification/correspondences/match_sets.h"
#include "loop_verification/correspondences/projection_search.h"
#include "loop_verification/joint_ba/joint_ba.h"
#include "loop_verification/upright_pnp.h"
#include "loop_verification/window.h"
#include "loop_verification/window_cache.h"

namespace pangea {

// Of what several steps use.
struct CommonStepOptions {
  WindowOptions window;
  JointBaOptions ba;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("window", &window, "the local windows that are aligned");
    archive.Section("ba", &ba, "joint bundle adjustment of both windows");
  }
};

// A value that a step demands something of.
struct Measurement {
  std::string_view step;    // its name in the list
  std::string_view option;  // the limit's name
  double value = 0;
  bool at_least = false;  // else at most
  double limit = 0;
};

// What the steps saw, beside the verification result: for tests, for choosing the options, and for
// people.
struct LoopVerificationReport {
  std::string_view refused_by;        // the step's name
  std::vector<Measurement> measured;  // in the order of the steps
  std::vector<ShownMatch> first;      // the candidate's and the nearest descriptors'; PnP's inliers
  std::vector<ShownMatch> found;      // by projection, in the two keyframes; inliers of the BA

  // The last that was measured for this limit; 0 where no step came to it.
  double Measured(std::string_view option) const;
};

// A further gate of the caller's kind; an empty string lets pass. `T_odom_m_odom_c` is the
// alignment of the two maps' odom frames.
using LoopVerificationGate = std::function<std::string(const Rigid3& T_odom_m_odom_c)>;

// What a candidate is verified from. They go back further than the windows.
struct CandidateKeyframes {
  KeyframeWindow m;        // ends with the match
  KeyframeWindow c;        // ends with the query
  KeyframeWindow after_m;  // behind the match: they help to triangulate its corners
};

struct Verification {
  Verification(const CommonStepOptions& options, const CandidateKeyframes& keyframes,
               const PlaceCandidate& candidate, const LoopVerificationGate& gate,
               WindowCache* window_cache);

  const CommonStepOptions& options;
  const CandidateKeyframes& keyframes;
  const PlaceCandidate& candidate;
  const LoopVerificationGate& gate;
  WindowCache& window_cache;
  WindowPair windows;
  double guess_tilt_sigma = 0;  // radians, of roll and pitch between the windows

  std::vector<PointMatch> first_matches;
  std::optional<UprightPnpResult> pnp;
  PoseEstimate pose;                // the guess, refined
  std::vector<PointMatch> matches;  // that the BA used
  std::optional<JointBaResult> ba;
  std::string_view step;  // that looks at it now
  LoopVerificationReport report;

  // Whether the value is as demanded; it goes into the report.
  bool AtLeast(std::string_view option, double value, double limit);
  bool AtMost(std::string_view option, double value, double limit);

  std::vector<PointObservation> Observations(const std::vector<PointMatch>& of) const;
  // Of the matches the BA used.
  double inlier_ratio() const;
  std::vector<PointMatch> InlierMatches() const;
};

// What the caller's gate says to the present alignment.
std::string CheckGate(const CommonStepOptions& options, Verification* verification);

// Standard deviation in the worst direction.
double LargestSigma(const Eigen::Matrix3d& covariance);

}  // namespace pangea

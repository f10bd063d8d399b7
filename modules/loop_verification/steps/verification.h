#pragma once

// One candidate on its way through the steps (steps.h): what they are given, and what they hand on.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/server_messages.h"
#include "loop_verification/correspondences/match_sets.h"
#include "loop_verification/correspondences/projection_search.h"
#include "loop_verification/joint_ba/joint_ba.h"
#include "loop_verification/upright_pnp.h"
#include "loop_verification/window.h"

namespace pangea {

// Of what several steps use.
struct CommonStepOptions {
  WindowOptions window;
  UprightPnpOptions pnp;
  SearchOptions search;
  JointBaOptions ba;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("window", &window, "the local windows that are aligned");
    archive.Section("pnp", &pnp, "upright PnP");
    archive.Section("search", &search, "projection search");
    archive.Section("ba", &ba, "joint bundle adjustment of both windows");
  }
};

// What the steps saw, beside the verification result: for tests, for choosing the options, and for
// people.
struct LoopVerificationReport {
  std::string refused_by;  // the step's name
  int pnp_inliers = 0;
  int comparable = 0;  // points that ought to be found in the two keyframes
  double found_share = 0;
  double first_supported_share = 0;
  double supported_share = 0;  // 0 when it was not looked at
  int landmarks = 0;           // distinct inliers of the BA
  int cells = 0;               // image cells these occupy in one of the keyframes
  double tilt = 0;             // radians
  double tilt_chi2 = 0;
  double sigma_without_one_m = 0;  // worst, were the landmark that says most not there
  double sigma_of_sure_m = 0;      // worst, were there none but sure landmarks
  double halves_chi2 = 0;          // 0 when it was not looked at
  std::vector<ShownMatch> first;   // the candidate's and the nearest descriptors'; inliers of PnP
  std::vector<ShownMatch> found;   // by projection, in the two keyframes; inliers of the BA
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
               const PlaceCandidate& candidate, const LoopVerificationGate& gate);

  const CommonStepOptions& options;
  const CandidateKeyframes& keyframes;
  const PlaceCandidate& candidate;
  const LoopVerificationGate& gate;
  WindowPair windows;
  double guess_tilt_sigma = 0;  // radians, of roll and pitch between the windows

  std::vector<PointMatch> first_matches;
  std::optional<UprightPnpResult> pnp;
  PoseEstimate pose;                // the guess, refined
  std::vector<PointMatch> matches;  // that the BA used
  std::optional<JointBaResult> ba;
  LoopVerificationReport report;

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

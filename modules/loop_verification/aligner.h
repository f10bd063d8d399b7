#pragma once

// From a candidate pair of keyframes to a verification result: the geometry that inter_map_ba and
// fusion share (the paper, section IV.D).
//
// In: the windows of keyframes up to the match (m) and up to the query (c), and the candidate's
// matched corners. Out: a Constraint between the two bodies, accepted with its covariance or
// refused with the reason. The same input gives the same verification result.
//
//   candidate's corners + nearest descriptors -> upright PnP RANSAC -> views and gravity gates
//   -> projection search in the two keyframes -> visibility check
//   -> projection search in all keyframes, fundamental matrix -> joint BA -> acceptance (inliers,
//   covariance, no landmark that decides alone) -> projection search along the way
//   -> the two halves of the view
//
// The cheap steps come first: a bad candidate dies in the first two.

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "core/server_messages.h"
#include "loop_verification/correspondences/match_sets.h"
#include "loop_verification/correspondences/projection_search.h"
#include "loop_verification/joint_ba/joint_ba.h"
#include "loop_verification/upright_pnp.h"
#include "loop_verification/visibility_check.h"
#include "loop_verification/window.h"

namespace pangea {

struct LoopVerificationOptions {
  WindowOptions window;
  UprightPnpOptions pnp;
  SearchOptions search;
  JointBaOptions ba;

  // Matching without a prediction.
  int first_max_hamming = 64;
  double first_max_ratio = 0.85;
  int min_pnp_inliers = 6;

  // Two keyframes that see the same: the angle between their lines of sight (for level cameras the
  // paper's yaw; a camera that looks down may be rotated any way), and their distance.
  double max_view_angle = 1.3;  // radians
  double max_distance_m = 15;

  // Roll and pitch between two gravity-aligned frames are zero within what the odometries say.
  // Guesses are led by it loosely, so that a wrong one is not bent into what gravity allows; what
  // the images alone say in the end must agree with it: 99 % of 2 degrees of freedom. The
  // odometries' claims do not count how well each knows its camera's rotation in its body; real
  // ones know it to a quarter of a degree (docs/decisions/loop_verification.md).
  double guess_tilt_floor = 0.006;  // radians, of each odometry
  double gravity_floor = 0.005;     // radians, the same at the end
  double max_tilt_chi2 = 9.2;
  double max_tilt = 0.06;  // radians, whatever the odometries say

  // Visibility check, first in the two keyframes, then along the way to them: of the points that
  // ought to be seen the share that is found, and the share of the view where they are
  // (visibility_check.h).
  int min_found = 10;
  int min_comparable = 15;
  double min_found_share = 0.08;
  double min_first_supported_share = 0.3;
  double min_supported_share = 0.55;
  int visibility_keyframes = 10;  // up to each of the two; not fewer than the window
  int visibility_stride = 3;      // every third of these is looked into

  // Acceptance.
  int min_inliers = 16;           // distinct landmarks
  double min_inlier_ratio = 0.5;  // of the matches the BA used
  int min_occupied_cells = 6;     // of 6 x 4, in one of the two keyframes
  // Accepted means: nearer to the truth than 0.5 m and 5 degrees. Five standard deviations of the
  // worst direction, as images with few points err more often than a normal distribution says.
  // Sure landmarks alone must keep it in position: vague matches that fit may be wrong ones.
  double max_sigma_m = 0.1;
  double max_sigma_rad = 0.0175;
  // Between the poses of the view's two halves: 99 % of 6 degrees of freedom.
  double max_halves_chi2 = 16.8;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Section("window", &window, "the local windows that are aligned");
    archive.Section("pnp", &pnp, "upright PnP");
    archive.Section("search", &search, "projection search");
    archive.Section("ba", &ba, "joint bundle adjustment of both windows");
    archive.Add("first_max_hamming", &first_max_hamming, {0, 256}, "bits",
                "between descriptors matched without a prediction");
    archive.Add("first_max_ratio", &first_max_ratio, {0.01, 1}, "",
                "best to second-best Hamming distance there");
    archive.Add("min_pnp_inliers", &min_pnp_inliers, {3, 10000}, "", "of PnP");
    archive.Add("max_view_angle", &max_view_angle, {0.01, 3.15}, "rad",
                "between the two lines of sight");
    archive.Add("max_distance_m", &max_distance_m, {0.01, 10000}, "m", "between the two keyframes");
    archive.Add("guess_tilt_floor", &guess_tilt_floor, {0, 1}, "rad",
                "sigma of each gravity, at least, while guessing");
    archive.Add("gravity_floor", &gravity_floor, {0, 1}, "rad",
                "sigma of each gravity, at least, at the end");
    archive.Add("max_tilt_chi2", &max_tilt_chi2, {0.1, 1000}, "",
                "of the tilt between the two gravities, 2 degrees of freedom");
    archive.Add("max_tilt", &max_tilt, {0.001, 3.15}, "rad",
                "between the two gravities, whatever the odometries say");
    archive.Add("min_found", &min_found, {0, 100000}, "", "points found in the two keyframes");
    archive.Add("min_comparable", &min_comparable, {0, 100000}, "",
                "points that ought to be seen in the two keyframes");
    archive.Add("min_found_share", &min_found_share, {0, 1}, "",
                "of the points that ought to be seen");
    archive.Add("min_first_supported_share", &min_first_supported_share, {0, 1}, "",
                "of the view, in the two keyframes");
    archive.Add("min_supported_share", &min_supported_share, {0, 1}, "",
                "of the view, along the way to them");
    archive.Add("visibility_keyframes", &visibility_keyframes, {1, 1000}, "",
                "up to each of the two");
    archive.Add("visibility_stride", &visibility_stride, {1, 1000}, "",
                "every so many of these is looked into");
    archive.Add("min_inliers", &min_inliers, {4, 100000}, "", "distinct landmarks");
    archive.Add("min_inlier_ratio", &min_inlier_ratio, {0, 1}, "",
                "of the matches that the BA used");
    archive.Add("min_occupied_cells", &min_occupied_cells, {0, 24}, "",
                "of 6 x 4, in one of the two keyframes");
    archive.Add("max_sigma_m", &max_sigma_m, {0.001, 100}, "m", "of the worst direction");
    archive.Add("max_sigma_rad", &max_sigma_rad, {0.0001, 3.15}, "rad", "of the worst direction");
    archive.Add("max_halves_chi2", &max_halves_chi2, {0.1, 100000}, "",
                "between the poses of the view's two halves, 6 degrees of freedom");
  }
};

// What the steps saw, beside the verification result: for tests, for choosing the options, and for
// people.
struct LoopVerificationReport {
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

class Aligner {
 public:
  explicit Aligner(LoopVerificationOptions options) : options_(options) {}

  // Keyframes a verification result depends on: that many up to each of the two.
  int num_keyframes() const {
    return std::max(options_.window.num_keyframes, options_.visibility_keyframes);
  }

  // `frames_m` ends with the candidate's match, `frames_c` with the query; num_keyframes() each, or
  // fewer where their map begins.
  Constraint Align(const KeyframeWindow& frames_m, const KeyframeWindow& frames_c,
                   const PlaceCandidate& candidate, const LoopVerificationGate& gate,
                   LoopVerificationReport* report = nullptr) const;

 private:
  LoopVerificationOptions options_;
};

}  // namespace pangea

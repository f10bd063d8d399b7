#pragma once

// Errors of trajectories against ground truth: absolute (ATE), relative (RPE), joint over several
// agents of one map (one alignment for all), and coverage of the recording.
//
// Source: Sturm et al., IROS 2012 (ATE, RPE); Zhang & Scaramuzza, IROS 2018 (alignments).

#include <cstdint>
#include <optional>
#include <vector>

#include "eval/trajectory_alignment.h"
#include "recording/trajectory.h"

namespace pangea {

// One estimated pose and the ground truth at its time.
struct PosePair {
  int64_t utime = 0;
  Rigid3 T_estimate_body;
  Rigid3 T_reference_body;
};

// Ground truth usually has 200 Hz; it is not interpolated across longer gaps than this.
inline constexpr int64_t kMaxGroundTruthGapUs = 100'000;

// Interpolates the reference at the estimate's stamps. Poses outside the reference, or in one of
// its gaps longer than max_gap_us, have no pair.
std::vector<PosePair> Associate(const Trajectory& estimate, const Trajectory& reference,
                                int64_t max_gap_us = kMaxGroundTruthGapUs);

struct Statistics {
  size_t count = 0;
  double rmse = 0, mean = 0, median = 0, max = 0;
};
Statistics StatisticsOf(std::vector<double> values);

struct PoseError {
  int64_t utime = 0;
  double position_m = 0;
  double rotation_rad = 0;
};

struct Ate {
  TrajectoryAlignment alignment;
  Statistics position_m;
  Statistics rotation_rad;
  std::vector<PoseError> errors;
};

// With fewer pairs an alignment always fits, and the error is meaningless.
inline constexpr size_t kMinPairs = 3;

// Empty with fewer than kMinPairs pairs.
std::optional<Ate> AbsoluteError(const std::vector<PosePair>& pairs, TrajectoryAlignmentKind kind);

struct JointAte {
  TrajectoryAlignment alignment;  // the one alignment for all agents
  Statistics position_m;          // over all their poses
  std::vector<Ate> agents;        // each with that alignment, in the order given
};

// Empty with fewer than kMinPairs pairs in total.
std::optional<JointAte> JointAbsoluteError(const std::vector<std::vector<PosePair>>& agents,
                                           TrajectoryAlignmentKind kind);

struct Rpe {
  Statistics position_m;
  Statistics rotation_rad;
};

// Relative error over every part of the reference with a path length of `distance_m`, or over every
// `duration_s`; empty if no part is that long.
std::optional<Rpe> RelativeErrorOverDistance(const std::vector<PosePair>& pairs, double distance_m);
std::optional<Rpe> RelativeErrorOverTime(const std::vector<PosePair>& pairs, double duration_s);

// A stationary body has a keyframe every 5 s; if poses are further apart than this, some are
// missing.
inline constexpr int64_t kMaxPoseStepUs = 6'000'000;

// The share, 0 to 1, of the reference's time after its first 5 s (for the initialisation) that is
// covered: between two poses at most kMaxPoseStepUs apart, or within 1 s of a pose. Empty if the
// reference is not longer than 5 s.
inline constexpr int64_t kCoverageGraceUs = 5'000'000;
inline constexpr int64_t kCoverageReachUs = 1'000'000;
std::optional<double> Coverage(const Trajectory& estimate, const Trajectory& reference);

}  // namespace pangea

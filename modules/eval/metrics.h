#pragma once

// Errors of trajectories against ground truth: absolute (ATE), relative (RPE), joint over several
// agents of one map (one alignment for all), and how much of the recording was covered.
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

// Ground truth is sampled at 200 Hz as a rule; across a hole longer than this it is not invented.
inline constexpr int64_t kMaxGroundTruthGapUs = 100'000;

// Interpolates the reference at the estimate's stamps; poses outside it, or in one of its holes
// longer than max_gap_us, have no pair.
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

// Below this number of pairs an alignment explains everything and an error says nothing.
inline constexpr size_t kMinPairs = 3;

// Nothing with fewer than kMinPairs pairs.
std::optional<Ate> AbsoluteError(const std::vector<PosePair>& pairs, TrajectoryAlignmentKind kind);

struct JointAte {
  TrajectoryAlignment alignment;  // the one alignment for all agents
  Statistics position_m;          // over all their poses
  std::vector<Ate> agents;        // each under that alignment, in the order given
};

// Nothing with fewer than kMinPairs pairs altogether.
std::optional<JointAte> JointAbsoluteError(const std::vector<std::vector<PosePair>>& agents,
                                           TrajectoryAlignmentKind kind);

struct Rpe {
  Statistics position_m;
  Statistics rotation_rad;
};

// Relative error over every stretch of the reference that is `distance_m` of path long, or over
// every `duration_s`; nothing when no stretch is that long.
std::optional<Rpe> RelativeErrorOverDistance(const std::vector<PosePair>& pairs, double distance_m);
std::optional<Rpe> RelativeErrorOverTime(const std::vector<PosePair>& pairs, double duration_s);

// A stationary body gives a keyframe every 5 s; where poses are further apart, some are missing.
inline constexpr int64_t kMaxPoseStepUs = 6'000'000;

// The share of the reference's time after its first 5 s (the time to initialise) that has a pose:
// it lies between two poses at most kMaxPoseStepUs apart, or within 1 s of one. 0 to 1; nothing
// when the reference is not longer than 5 s.
inline constexpr int64_t kCoverageGraceUs = 5'000'000;
inline constexpr int64_t kCoverageReachUs = 1'000'000;
std::optional<double> Coverage(const Trajectory& estimate, const Trajectory& reference);

}  // namespace pangea

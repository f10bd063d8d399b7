#pragma once

// The problem that SolveJointBa builds and solves twice, and what its solution knows of the newest
// keyframe's pose (joint_ba.h). Internal to the alignment.

#include <ceres/ceres.h>

#include <array>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "loop_verification/joint_ba/ba_factors.h"
#include "loop_verification/joint_ba/frame_information.h"
#include "loop_verification/joint_ba/joint_ba.h"

namespace pangea {

// Whose points and poses: the match's window or the query's.
constexpr int kSideM = 0, kSideC = 1;

// Of the window that holds the match's point.
inline int HolderSide(const PointMatch& match) {
  return match.direction == Direction::kForward ? kSideM : kSideC;
}

class JointProblem {
 public:
  JointProblem(const WindowPair& windows, const Rigid3& T_m_c, const JointBaOptions& options);
  ~JointProblem() = default;
  JointProblem(const JointProblem&) = delete;
  JointProblem& operator=(const JointProblem&) = delete;

  // Builds and solves the problem over the matches `use` names; the problem owns the loss. False
  // when it fails.
  bool Solve(const std::vector<PointMatch>& matches, const std::vector<bool>& use,
             ceres::LossFunction* loss);

  // Squared residuals of the matches in use; a point whose depth denies its prior counts as far
  // off in all its matches.
  void Classify(const std::vector<PointMatch>& matches, std::vector<bool>* inlier,
                double* chi2_sum);

  Rigid3 NewestPose(int side) { return PoseFromBlock(Newest(side)); }

  // Marginal covariances of the newest c keyframe's pose, in window m's frame: the inverse of the
  // Schur complement of the points in J^T J. Of all, without the landmark that says most, and of
  // the sure landmarks alone.
  struct Marginals {
    Matrix6d all, without_one;
    std::optional<Matrix6d> of_sure;  // nothing when they do not fix it
  };
  std::optional<Marginals> MarginalsOfNewestC(const std::vector<PointMatch>& matches,
                                              const std::vector<bool>& use);

 private:
  using PointKey = std::pair<int, int>;  // (side, landmark)

  // The points that matches join into one landmark of both windows together.
  struct JoinedLandmark {
    std::vector<PointKey> points;
    bool sure = false;  // one of its matches is
  };

  struct Reprojection {
    const ReprojectionFactor* factor = nullptr;
    const double* host = nullptr;
    const double* target = nullptr;
    const double* point = nullptr;
    double share = 1;
    size_t match = 0;
  };

  std::optional<FrameInformation> Information();
  std::vector<JoinedLandmark> Landmarks(const std::vector<PointMatch>& matches,
                                        const std::vector<bool>& use) const;
  std::set<size_t> MutualMatches(const std::vector<PointMatch>& matches,
                                 const std::vector<bool>& use) const;
  // Everything but the points and the fixed newest keyframe of m; the newest of c first.
  std::vector<double*> FrameBlocks();
  double ScaleSigma(int side) const;
  void AddPosesAndEdges();
  void AddMatch(const PointMatch& match, double share, ceres::LossFunction* loss,
                std::set<PointKey>* added);

  // The other window's landmark that the match's corner is, or -1.
  int Other(const PointMatch& match) const {
    return windows_[1 - HolderSide(match)]
        ->landmark_of_corner[match.observed.frame][match.observed.corner];
  }
  const WindowLandmark& Landmark(const PointMatch& match) const {
    return windows_[HolderSide(match)]->landmarks[match.landmark];
  }

  double* Pose(int side, int frame) {
    return &blocks_[pose_offset_[side] + 7 * static_cast<size_t>(frame)];
  }
  double* Newest(int side) { return Pose(side, windows_[side]->newest()); }
  double* Scale(int side) { return &blocks_[scale_offset_[side]]; }
  double* Point(const PointKey& key) {
    return &blocks_[point_offset_[key.first] + 3 * static_cast<size_t>(key.second)];
  }

  std::array<const Window*, 2> windows_;
  JointBaOptions options_;
  // All parameters in one piece: Ceres orders blocks by address, and so the order, and with it the
  // last digit, is the same in every run.
  std::vector<double> blocks_;
  std::array<size_t, 2> pose_offset_{}, scale_offset_{}, point_offset_{};
  std::set<PointKey> used_points_;
  std::vector<Reprojection> reprojections_;
  std::optional<ceres::Problem> problem_;
};

}  // namespace pangea

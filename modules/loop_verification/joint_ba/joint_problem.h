#pragma once

// The problem that SolveJointBa builds and solves twice, and what its solution knows of the newest
// keyframe's pose (joint_ba.h). Internal to the alignment.
//
// Frames are counted through both windows: c's newest, c's others, m's others, and at last m's
// newest, which is held. The normal equations have six columns for each but the last, then both
// scales.

#include <Eigen/Core>
#include <array>
#include <optional>
#include <utility>
#include <vector>

#include "core/least_squares/edge_residual.h"
#include "loop_verification/joint_ba/frame_information.h"
#include "loop_verification/joint_ba/hosted_point.h"
#include "loop_verification/joint_ba/joint_ba.h"

namespace pangea {

// Whose points and poses: the match's window or the query's.
constexpr int kSideM = 0, kSideC = 1;

// Of the window that holds the match's point.
inline int HolderSide(const PointMatch& match) {
  return match.direction == Direction::kForward ? kSideM : kSideC;
}

struct JointState {
  std::vector<Rigid3> T_w_body;         // of each frame; w: window m's axes
  std::array<double, 2> log_scale{};    // of each side
  std::vector<Eigen::Vector3d> points;  // (x, y, inverse depth)

  // All of it is what a step moves (core/least_squares/levenberg_marquardt.h).
  JointState Estimate() const { return *this; }
  void SetEstimate(JointState estimate) { *this = std::move(estimate); }
};

// The cost's derivatives by the frames' errors, points eliminated:
// cost(state (+) e) ~ cost + g^T e + 1/2 e^T H e. Of H the lower triangle.
struct JointEquations {
  double cost = 0;
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

class JointProblem {
 public:
  JointProblem(const WindowPair& windows, const Rigid3& T_m_c, const JointBaOptions& options);
  JointProblem(const JointProblem&) = delete;
  JointProblem& operator=(const JointProblem&) = delete;

  // Builds the problem over the matches `use` names and solves it, from where the last solve ended.
  // False when a point is behind a camera from the start.
  bool Solve(const std::vector<PointMatch>& matches, const std::vector<bool>& use,
             const RobustLoss& loss);

  // Squared residuals of the matches in use; a point whose depth denies its prior counts as far
  // off in all its matches.
  void Classify(std::vector<bool>* inlier, double* chi2_sum) const;

  Rigid3 NewestPose(int side) const {
    return state_.T_w_body[Frame(side, windows_[side]->newest())];
  }

  // Marginal covariances of the newest c keyframe's pose, in window m's frame: the inverse of the
  // Schur complement of the points in J^T J. Of all, without the landmark that says most, and of
  // the sure landmarks alone.
  struct Marginals {
    Matrix6d all, without_one;
    std::optional<Matrix6d> of_sure;  // nothing when they do not fix it
  };
  std::optional<Marginals> MarginalsOfNewestC(const std::vector<PointMatch>& matches,
                                              const std::vector<bool>& use);

  // The last problem's pieces, for tests against another solver.
  struct Edge {
    int from = 0, to = 0, side = 0;
    EdgeResidual residual;
  };
  const JointState& state() const { return state_; }
  const std::vector<Edge>& edges() const { return edges_; }
  const std::vector<HostedPoint>& points() const { return points_; }
  const std::vector<Rigid3>& T_body_cam() const { return T_body_cam_; }
  double ScaleSigma(int side) const;
  double Cost(const JointState& state, const RobustLoss& loss) const;
  JointEquations Linearise(const JointState& state, const RobustLoss& loss, double damping);

 private:
  int num_frames() const { return static_cast<int>(T_body_cam_.size()); }
  int num_columns() const { return 6 * (num_frames() - 1) + 2; }
  int ScaleColumn(int side) const { return 6 * (num_frames() - 1) + side; }
  // The held frame's are behind all others.
  int PoseColumn(int frame) const { return 6 * frame + (frame == num_frames() - 1 ? 2 : 0); }
  int Frame(int side, int window_frame) const;

  std::vector<PosedCamera> Cameras(const JointState& state) const;
  std::vector<int> ColumnsOf(const HostedPoint& point) const;
  // By the last linearisation's points.
  void Move(const Eigen::VectorXd& step, JointState* state) const;

  void AddMatch(const PointMatch& match, size_t index, double share);
  std::vector<bool> MutualMatches(const std::vector<PointMatch>& matches,
                                  const std::vector<bool>& use) const;
  // The points that matches join into one landmark of both windows together, and whether one of
  // these matches is sure.
  std::vector<JoinedPoints> Landmarks(const std::vector<PointMatch>& matches,
                                      const std::vector<bool>& use) const;

  // The other window's landmark that the match's corner is, or -1.
  int Other(const PointMatch& match) const {
    return windows_[1 - HolderSide(match)]
        ->landmark_of_corner[match.observed.frame][match.observed.corner];
  }

  std::array<const Window*, 2> windows_;
  JointBaOptions options_;
  std::vector<Rigid3> T_body_cam_;  // of each frame
  std::vector<Edge> edges_;
  // By side and landmark: where the last solve left it, and its index in points_ or -1.
  std::array<std::vector<Eigen::Vector3d>, 2> solved_;
  std::array<std::vector<int>, 2> index_;
  std::vector<HostedPoint> points_;          // those that matches use
  std::vector<std::vector<int>> columns_;    // of each
  std::vector<EliminatedPoint> eliminated_;  // each, in the last linearisation
  JointState state_;
};

}  // namespace pangea

#pragma once

// The least-squares problem that SolveJointBa builds and solves twice, and the marginal covariance
// of the newest keyframe's pose (joint_ba.h). Internal to the alignment.
//
// Frames are numbered through both windows: c's newest, c's others, m's others, and last m's
// newest, which is fixed. The normal equations have six columns for each frame but the last, then
// the two scales.

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

// The window of a point or pose: the match's or the query's.
constexpr int kSideM = 0, kSideC = 1;

// The side of the window that holds the match's point.
inline int HolderSide(const PointMatch& match) {
  return match.direction == Direction::kForward ? kSideM : kSideC;
}

struct JointState {
  std::vector<Rigid3> T_w_body;         // per frame; w: frame of window m
  std::array<double, 2> log_scale{};    // per side
  std::vector<Eigen::Vector3d> points;  // (x, y, inverse depth)

  // For levenberg_marquardt.h: the estimate is the whole state.
  JointState Estimate() const { return *this; }
  void SetEstimate(JointState estimate) { *this = std::move(estimate); }
};

// Derivatives of the cost with respect to the frames' errors e, points eliminated: cost(state (+)
// e) ~ cost + g^T e + 1/2 e^T H e. Only the lower triangle of H is set.
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

  // Builds the problem from the matches with `use`, and solves it, starting at the last solution.
  // False if a point is behind a camera at the start.
  bool Solve(const std::vector<PointMatch>& matches, const std::vector<bool>& use,
             const RobustLoss& loss);

  // Decides which of the matches in use are inliers, and sums the inliers' squared residuals. If a
  // point's depth contradicts its prior, all its matches are outliers.
  void Classify(std::vector<bool>* inlier, double* chi2_sum) const;

  Rigid3 NewestPose(int side) const {
    return state_.T_w_body[Frame(side, windows_[side]->newest())];
  }

  // Marginal covariances of the newest c keyframe's pose, in window m's frame: the inverse of the
  // Schur complement of the points in J^T J. With all landmarks, without the landmark that
  // contributes most, and with the sure landmarks alone. Empty if one of the first two is
  // undetermined.
  struct Marginals {
    Matrix6d all;
    std::optional<Matrix6d> without_one;  // empty if not wanted
    std::optional<Matrix6d> of_sure;      // empty if not wanted or undetermined
  };
  std::optional<Marginals> MarginalsOfNewestC(const std::vector<PointMatch>& matches,
                                              const std::vector<bool>& use,
                                              JointBaCovariances wanted);

  // The parts of the last problem, for tests against another solver.
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
  // The fixed frame's columns come after all others.
  int PoseColumn(int frame) const { return 6 * frame + (frame == num_frames() - 1 ? 2 : 0); }
  int Frame(int side, int window_frame) const;

  std::vector<PosedCamera> Cameras(const JointState& state) const;
  std::vector<int> ColumnsOf(const HostedPoint& point) const;
  // Uses the eliminated points of the last linearisation.
  void Move(const Eigen::VectorXd& step, JointState* state) const;

  void AddMatch(const PointMatch& match, size_t index, double share);
  std::vector<bool> MutualMatches(const std::vector<PointMatch>& matches,
                                  const std::vector<bool>& use) const;
  // Groups the points that matches connect into one landmark of both windows, and marks a group as
  // sure if one of its matches is.
  std::vector<JoinedPoints> Landmarks(const std::vector<PointMatch>& matches,
                                      const std::vector<bool>& use) const;

  // The landmark, in the observing window, of the match's corner; or -1.
  int Other(const PointMatch& match) const {
    return windows_[1 - HolderSide(match)]
        ->landmark_of_corner[match.observed.frame][match.observed.corner];
  }

  std::array<const Window*, 2> windows_;
  JointBaOptions options_;
  std::vector<Rigid3> T_body_cam_;  // of each frame
  std::vector<Edge> edges_;
  // By side and landmark: the result of the last solve, and the index in points_ or -1.
  std::array<std::vector<Eigen::Vector3d>, 2> solved_;
  std::array<std::vector<int>, 2> index_;
  std::vector<HostedPoint> points_;          // points with matches in use
  std::vector<std::vector<int>> columns_;    // of each point
  std::vector<EliminatedPoint> eliminated_;  // per point, from the last linearisation
  JointState state_;
};

}  // namespace pangea

#include "common/alignment/joint_ba.h"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "common/alignment/ba_factors.h"
#include "common/median.h"

namespace pangea {
namespace {

using PointKey = std::pair<int, int>;  // (side, landmark)

constexpr int kSideM = 0, kSideC = 1;

int HolderSide(const PointMatch& match) {
  return match.direction == Direction::kForward ? kSideM : kSideC;
}

// Adds a little to an odometry edge's covariance: no odometry is better than this, and a singular
// matrix has no root.
Matrix6d Floored(const Matrix6d& covariance) {
  constexpr double kTranslation_m = 2e-4, kRotation_rad = 5e-5;
  Matrix6d floored = covariance;
  floored.diagonal().head<3>().array() += kTranslation_m * kTranslation_m;
  floored.diagonal().tail<3>().array() += kRotation_rad * kRotation_rad;
  return floored;
}

class JointProblem {
 public:
  JointProblem(const Window& window_m, const Window& window_c, const Rigid3& T_m_c,
               const JointBaOptions& options)
      : windows_{&window_m, &window_c}, options_(options) {
    size_t size = 0;
    for (const int side : {kSideM, kSideC}) {
      pose_offset_[side] = size;
      size += 7 * windows_[side]->frames.size();
      scale_offset_[side] = size;
      size += 1;
    }
    for (const int side : {kSideM, kSideC}) {
      point_offset_[side] = size;
      size += 3 * windows_[side]->landmarks.size();
    }
    blocks_.resize(size);
    for (const int side : {kSideM, kSideC}) {
      const Window& window = *windows_[side];
      for (int f = 0; f <= window.newest(); ++f) {
        PoseToBlock(side == kSideM ? window.T_w_body[f] : T_m_c * window.T_w_body[f],
                    Pose(side, f));
      }
      for (size_t l = 0; l < window.landmarks.size(); ++l) {
        const WindowLandmark& landmark = window.landmarks[l];
        const Eigen::Vector2d ray = window.frames[landmark.host.frame]->ray(landmark.host.corner);
        const PointKey key{side, static_cast<int>(l)};
        std::copy_n(std::array{ray.x(), ray.y(), landmark.inverse_depth}.data(), 3, Point(key));
      }
    }
  }

  // Builds and solves the problem over the matches `use` names; the problem owns the loss. False
  // when it fails.
  bool Solve(const std::vector<PointMatch>& matches, const std::vector<bool>& use,
             ceres::LossFunction* loss) {
    problem_.emplace();
    reprojections_.clear();
    AddPosesAndEdges();
    const std::set<size_t> halved = MutualMatches(matches, use);
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    std::set<PointKey> added;
    for (size_t i = 0; i < matches.size(); ++i) {
      if (use[i]) {
        const double share = halved.contains(i) ? std::sqrt(0.5) : 1.0;
        AddMatch(matches[i], share, loss, &added);
        reprojections_.back().match = i;
      }
    }
    for (const PointKey& key : added) {
      ordering->AddElementToGroup(Point(key), 0);
    }
    for (double* block : FrameBlocks()) {
      ordering->AddElementToGroup(block, 1);
    }
    ordering->AddElementToGroup(Newest(kSideM), 1);

    ceres::Solver::Options solver;
    solver.linear_solver_type = ceres::DENSE_SCHUR;
    solver.linear_solver_ordering = ordering;
    solver.max_num_iterations = options_.iterations;
    solver.num_threads = 1;
    solver.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &*problem_, &summary);
    used_points_ = std::move(added);
    return summary.IsSolutionUsable();
  }

  // Squared residuals of the matches in use; a point whose depth denies its prior counts as far
  // off in all its matches.
  void Classify(const std::vector<PointMatch>& matches, std::vector<bool>* inlier,
                double* chi2_sum) {
    *chi2_sum = 0;
    for (const Reprojection& reprojection : reprojections_) {
      const PointMatch& match = matches[reprojection.match];
      Eigen::Vector2d r;
      const double* blocks[] = {reprojection.host, reprojection.target, reprojection.point};
      const bool valid = reprojection.factor->Evaluate(blocks, r.data(), nullptr);
      const WindowLandmark& landmark = Landmark(match);
      const double kappa = *Scale(HolderSide(match));
      const double depth_error =
          (reprojection.point[2] - std::exp(-kappa) * landmark.inverse_depth) /
          landmark.inverse_depth_sigma;
      const double chi2 = r.squaredNorm() / (reprojection.share * reprojection.share);
      (*inlier)[reprojection.match] =
          valid && chi2 < options_.max_chi2 && depth_error * depth_error < options_.max_depth_chi2;
      if ((*inlier)[reprojection.match]) {
        *chi2_sum += chi2;
      }
    }
  }

  Rigid3 NewestPose(int side) { return PoseFromBlock(Newest(side)); }

  // Marginal covariance of the newest c keyframe's pose, in window m's frame: the inverse of the
  // Schur complement of the points in J^T J.
  std::optional<Matrix6d> MarginalOfNewestC() {
    ceres::Problem::EvaluateOptions evaluate;
    evaluate.apply_loss_function = false;
    evaluate.num_threads = 1;
    const std::vector<double*> frames = FrameBlocks();
    evaluate.parameter_blocks = frames;
    const int num_frame_columns = 6 * (static_cast<int>(frames.size()) - 2) + 2;
    for (const PointKey& key : used_points_) {
      evaluate.parameter_blocks.push_back(Point(key));
    }
    ceres::CRSMatrix jacobian;
    if (!problem_->Evaluate(evaluate, nullptr, nullptr, nullptr, &jacobian)) {
      return std::nullopt;
    }
    const int num_points = static_cast<int>(used_points_.size());
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(num_frame_columns, num_frame_columns);
    std::vector<Eigen::Matrix3d> V(num_points, Eigen::Matrix3d::Zero());
    std::vector<Eigen::MatrixXd> W(num_points, Eigen::MatrixXd::Zero(num_frame_columns, 3));
    for (int row = 0; row < jacobian.num_rows; ++row) {
      for (int a = jacobian.rows[row]; a < jacobian.rows[row + 1]; ++a) {
        const int i = jacobian.cols[a];
        for (int b = jacobian.rows[row]; b < jacobian.rows[row + 1]; ++b) {
          const int j = jacobian.cols[b];
          const double product = jacobian.values[a] * jacobian.values[b];
          if (i < num_frame_columns && j < num_frame_columns) {
            H(i, j) += product;
          } else if (j >= num_frame_columns) {
            const int point = (j - num_frame_columns) / 3;
            const int column = (j - num_frame_columns) % 3;
            if (i < num_frame_columns) {
              W[point](i, column) += product;
            } else {
              V[point]((i - num_frame_columns) % 3, column) += product;
            }
          }
        }
      }
    }
    for (int point = 0; point < num_points; ++point) {
      H.noalias() -= W[point] * V[point].inverse() * W[point].transpose();
    }
    const Eigen::LLT<Eigen::MatrixXd> llt(H);
    if (llt.info() != Eigen::Success) {
      return std::nullopt;
    }
    const Eigen::MatrixXd columns = llt.solve(Eigen::MatrixXd::Identity(num_frame_columns, 6));
    const Matrix6d covariance = columns.topRows<6>();
    return covariance.allFinite() ? std::make_optional(covariance) : std::nullopt;
  }

  ~JointProblem() = default;
  JointProblem(const JointProblem&) = delete;
  JointProblem& operator=(const JointProblem&) = delete;

 private:
  struct Reprojection {
    const ReprojectionFactor* factor = nullptr;
    const double* host = nullptr;
    const double* target = nullptr;
    const double* point = nullptr;
    double share = 1;
    size_t match = 0;
  };

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

  // Everything but the points and the fixed newest keyframe of m; the newest of c first.
  std::vector<double*> FrameBlocks() {
    std::vector<double*> blocks = {Newest(kSideC)};
    for (int f = 0; f < windows_[kSideC]->newest(); ++f) {
      blocks.push_back(Pose(kSideC, f));
    }
    for (int f = 0; f < windows_[kSideM]->newest(); ++f) {
      blocks.push_back(Pose(kSideM, f));
    }
    blocks.push_back(Scale(kSideM));
    blocks.push_back(Scale(kSideC));
    return blocks;
  }

  void AddPosesAndEdges() {
    for (const int side : {kSideM, kSideC}) {
      for (int f = 0; f <= windows_[side]->newest(); ++f) {
        problem_->AddParameterBlock(Pose(side, f), 7, new RigidManifold);
      }
      problem_->AddParameterBlock(Scale(side), 1);
      problem_->AddResidualBlock(new ScalePriorFactor(options_.scale_sigma), nullptr, Scale(side));
      for (int f = 1; f <= windows_[side]->newest(); ++f) {
        const OdometryEdge& edge = *windows_[side]->keyframe(f).edge;
        problem_->AddResidualBlock(new EdgeFactor(edge.T_from_this, Floored(edge.covariance)),
                                   nullptr, Pose(side, f - 1), Pose(side, f), Scale(side));
      }
    }
    problem_->SetParameterBlockConstant(Newest(kSideM));
  }

  // Matches whose two corners meet in both directions: the same two pixels twice, so each counts
  // half.
  std::set<size_t> MutualMatches(const std::vector<PointMatch>& matches,
                                 const std::vector<bool>& use) const {
    std::set<std::array<int, 3>> pairs;  // (holder's side, its landmark, the other's landmark)
    const auto pair_of = [this](const PointMatch& match) {
      const int other = windows_[1 - HolderSide(match)]
                            ->landmark_of_corner[match.observed.frame][match.observed.corner];
      return std::array<int, 3>{HolderSide(match), match.landmark, other};
    };
    for (size_t i = 0; i < matches.size(); ++i) {
      if (use[i]) {
        pairs.insert(pair_of(matches[i]));
      }
    }
    std::set<size_t> mutual;
    for (size_t i = 0; i < matches.size(); ++i) {
      const auto [side, own, other] = pair_of(matches[i]);
      if (use[i] && pairs.contains({1 - side, other, own})) {
        mutual.insert(i);
      }
    }
    return mutual;
  }

  void AddMatch(const PointMatch& match, double share, ceres::LossFunction* loss,
                std::set<PointKey>* added) {
    const int side = HolderSide(match);
    const Window& holder = *windows_[side];
    const Window& observer = *windows_[1 - side];
    const WindowLandmark& landmark = Landmark(match);
    const KeyframeView& host = *holder.frames[landmark.host.frame];
    const KeyframeView& target = *observer.frames[match.observed.frame];
    const PointKey key{side, match.landmark};
    double* point = Point(key);
    if (added->insert(key).second) {
      const double sigma = CornerSigma(holder.corner(landmark.host), options_.pixel_sigma);
      problem_->AddResidualBlock(
          new PointPriorFactor(host.ray(landmark.host.corner),
                               share / sigma * host.pixel_jacobian(landmark.host.corner),
                               landmark.inverse_depth, landmark.inverse_depth_sigma),
          nullptr, point, Scale(side));
    }
    const double sigma = CornerSigma(observer.corner(match.observed), options_.pixel_sigma);
    auto* factor = new ReprojectionFactor(
        host.keyframe().camera.T_body_cam, target.keyframe().camera.T_body_cam,
        target.ray(match.observed.corner),
        share / sigma * target.pixel_jacobian(match.observed.corner));
    double* host_pose = Pose(side, landmark.host.frame);
    double* target_pose = Pose(1 - side, match.observed.frame);
    problem_->AddResidualBlock(factor, loss, host_pose, target_pose, point);
    reprojections_.push_back({factor, host_pose, target_pose, point, share, 0});
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

// Median distance of the inliers' points from the newest keyframe of their window.
double MedianDistance(const Window& window_m, const Window& window_c,
                      const std::vector<PointMatch>& matches, const std::vector<bool>& inlier) {
  std::vector<double> distances;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (inlier[i]) {
      const Window& holder = HolderSide(matches[i]) == kSideM ? window_m : window_c;
      distances.push_back(holder.landmarks[matches[i].landmark].p_w.norm());
    }
  }
  return Median(std::move(distances));
}

}  // namespace

std::optional<JointBaResult> SolveJointBa(const Window& window_m, const Window& window_c,
                                          const std::vector<PointMatch>& matches,
                                          const Rigid3& T_m_c, const JointBaOptions& options) {
  JointProblem problem(window_m, window_c, T_m_c, options);
  JointBaResult result;
  result.inlier.assign(matches.size(), true);
  double chi2_sum = 0;
  // Round one finds the outliers, round two is the estimate.
  constexpr double kCauchyScale = 2.0, kHuberScale = 2.0;
  if (!problem.Solve(matches, result.inlier, new ceres::CauchyLoss(kCauchyScale))) {
    return std::nullopt;
  }
  problem.Classify(matches, &result.inlier, &chi2_sum);
  if (!problem.Solve(matches, result.inlier, new ceres::HuberLoss(kHuberScale))) {
    return std::nullopt;
  }
  problem.Classify(matches, &result.inlier, &chi2_sum);
  for (const bool inlier : result.inlier) {
    result.num_inlier_observations += inlier ? 1 : 0;
  }
  const auto covariance = problem.MarginalOfNewestC();
  if (!covariance || result.num_inlier_observations == 0) {
    return std::nullopt;
  }
  // chi2 is in sigmas of each corner's own octave; two dimensions an observation.
  const double variance = chi2_sum / (2.0 * result.num_inlier_observations);
  result.rms_px = options.pixel_sigma * std::sqrt(2.0 * variance);

  const Rigid3 T_w_Km = problem.NewestPose(kSideM);
  const Rigid3 T_w_Kc = problem.NewestPose(kSideC);
  result.T_m_c = T_w_Kc * window_c.T_w_body.back().Inverse();
  result.T_Km_Kc = T_w_Km.Inverse() * T_w_Kc;
  // From the window's axes to Km's; its origin is Km's already.
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = T_w_Km.R().transpose();
  turn.bottomRightCorner<3, 3>() = T_w_Km.R().transpose();
  // Never smaller than the residuals say.
  result.covariance = std::max(1.0, variance) * turn * *covariance * turn.transpose();
  const double turn_floor =
      options.systematic_px * window_c.keyframe(window_c.newest()).camera.PixelAngle();
  const double step_floor = turn_floor * MedianDistance(window_m, window_c, matches, result.inlier);
  result.covariance.diagonal().head<3>().array() += step_floor * step_floor;
  result.covariance.diagonal().tail<3>().array() += turn_floor * turn_floor;
  return result;
}

}  // namespace pangea

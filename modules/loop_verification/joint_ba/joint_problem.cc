#include "loop_verification/joint_ba/joint_problem.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

namespace pangea {
namespace {

// Adds a little to an odometry edge's covariance: no odometry is better than this, and a singular
// matrix has no root.
Matrix6d Floored(const Matrix6d& covariance) {
  constexpr double kTranslation_m = 2e-4, kRotation_rad = 5e-5;
  Matrix6d floored = covariance;
  floored.diagonal().head<3>().array() += kTranslation_m * kTranslation_m;
  floored.diagonal().tail<3>().array() += kRotation_rad * kRotation_rad;
  return floored;
}

}  // namespace

JointProblem::JointProblem(const WindowPair& windows, const Rigid3& T_m_c,
                           const JointBaOptions& options)
    : windows_{&windows.m, &windows.c}, options_(options) {
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
      PoseToBlock(side == kSideM ? window.T_w_body[f] : T_m_c * window.T_w_body[f], Pose(side, f));
    }
    for (size_t l = 0; l < window.landmarks.size(); ++l) {
      const WindowLandmark& landmark = window.landmarks[l];
      const Eigen::Vector2d ray = window.frames[landmark.host.frame]->ray(landmark.host.corner);
      const PointKey key{side, static_cast<int>(l)};
      std::copy_n(std::array{ray.x(), ray.y(), landmark.inverse_depth}.data(), 3, Point(key));
    }
  }
}

bool JointProblem::Solve(const std::vector<PointMatch>& matches, const std::vector<bool>& use,
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

void JointProblem::Classify(const std::vector<PointMatch>& matches, std::vector<bool>* inlier,
                            double* chi2_sum) {
  *chi2_sum = 0;
  for (const Reprojection& reprojection : reprojections_) {
    const PointMatch& match = matches[reprojection.match];
    Eigen::Vector2d r;
    const double* blocks[] = {reprojection.host, reprojection.target, reprojection.point};
    const bool valid = reprojection.factor->Evaluate(blocks, r.data(), nullptr);
    const WindowLandmark& landmark = Landmark(match);
    const double kappa = *Scale(HolderSide(match));
    const double depth_error = (reprojection.point[2] - std::exp(-kappa) * landmark.inverse_depth) /
                               landmark.inverse_depth_sigma;
    const double chi2 = r.squaredNorm() / (reprojection.share * reprojection.share);
    (*inlier)[reprojection.match] =
        valid && chi2 < options_.max_chi2 && depth_error * depth_error < options_.max_depth_chi2;
    if ((*inlier)[reprojection.match]) {
      *chi2_sum += chi2;
    }
  }
}

std::optional<JointProblem::Marginals> JointProblem::MarginalsOfNewestC(
    const std::vector<PointMatch>& matches, const std::vector<bool>& use) {
  const auto information = Information();
  const auto all = information ? CovarianceOfFirst(information->total) : std::nullopt;
  if (!all) {
    return std::nullopt;
  }
  std::map<PointKey, size_t> index;
  for (const PointKey& key : used_points_) {
    index.emplace(key, index.size());
  }
  Marginals marginals{*all, *all, std::nullopt};
  Eigen::MatrixXd of_sure = information->total;
  for (const JoinedLandmark& landmark : Landmarks(matches, use)) {
    Eigen::MatrixXd rest = information->total;
    for (const PointKey& key : landmark.points) {
      rest -= information->of_point[index.at(key)];
      if (!landmark.sure) {
        of_sure -= information->of_point[index.at(key)];
      }
    }
    const std::optional<Matrix6d> without = CovarianceOfFirst(rest);
    if (!without) {
      return std::nullopt;
    }
    if (without->topLeftCorner<3, 3>().trace() >
        marginals.without_one.topLeftCorner<3, 3>().trace()) {
      marginals.without_one = *without;
    }
  }
  marginals.of_sure = CovarianceOfFirst(of_sure);
  return marginals;
}

std::optional<FrameInformation> JointProblem::Information() {
  ceres::Problem::EvaluateOptions evaluate;
  evaluate.apply_loss_function = false;
  evaluate.num_threads = 1;
  evaluate.parameter_blocks = FrameBlocks();
  const int num_frame_columns = 6 * (static_cast<int>(evaluate.parameter_blocks.size()) - 2) + 2;
  for (const PointKey& key : used_points_) {
    evaluate.parameter_blocks.push_back(Point(key));
  }
  ceres::CRSMatrix jacobian;
  if (!problem_->Evaluate(evaluate, nullptr, nullptr, nullptr, &jacobian)) {
    return std::nullopt;
  }
  return EliminatePoints(jacobian, num_frame_columns);
}

std::vector<JointProblem::JoinedLandmark> JointProblem::Landmarks(
    const std::vector<PointMatch>& matches, const std::vector<bool>& use) const {
  std::map<PointKey, PointKey> leader;
  for (const PointKey& key : used_points_) {
    leader.emplace(key, key);
  }
  for (size_t i = 0; i < matches.size(); ++i) {
    const int side = HolderSide(matches[i]);
    const PointKey own{side, matches[i].landmark}, other{1 - side, Other(matches[i])};
    if (use[i] && leader.contains(own) && leader.contains(other)) {
      const PointKey from = leader.at(other), to = leader.at(own);
      for (auto& [key, value] : leader) {
        value = value == from ? to : value;
      }
    }
  }
  std::map<PointKey, JoinedLandmark> landmarks;
  for (const auto& [key, value] : leader) {
    landmarks[value].points.push_back(key);
  }
  for (size_t i = 0; i < matches.size(); ++i) {
    const PointKey key{HolderSide(matches[i]), matches[i].landmark};
    if (use[i] && leader.contains(key) && matches[i].distance <= options_.sure_hamming) {
      landmarks.at(leader.at(key)).sure = true;
    }
  }
  std::vector<JoinedLandmark> joined;
  for (auto& [key, landmark] : landmarks) {
    joined.push_back(std::move(landmark));
  }
  return joined;
}

std::vector<double*> JointProblem::FrameBlocks() {
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

// Windows of one map have its unknown scale in common.
double JointProblem::ScaleSigma(int side) const {
  const Keyframe& newest = windows_[side]->newest_keyframe();
  const bool of_one_map = newest.id.map == windows_[1 - side]->newest_keyframe().id.map;
  return of_one_map ? options_.scale_sigma
                    : std::max(options_.scale_sigma, UnknownScaleSigma(newest.scale_sigma));
}

void JointProblem::AddPosesAndEdges() {
  for (const int side : {kSideM, kSideC}) {
    for (int f = 0; f <= windows_[side]->newest(); ++f) {
      problem_->AddParameterBlock(Pose(side, f), 7, new RigidManifold);
    }
    problem_->AddParameterBlock(Scale(side), 1);
    problem_->AddResidualBlock(new ScalePriorFactor(ScaleSigma(side)), nullptr, Scale(side));
    for (int f = 1; f <= windows_[side]->newest(); ++f) {
      const OdometryEdge& edge = *windows_[side]->keyframe(f).edge;
      problem_->AddResidualBlock(new EdgeFactor(edge.T_from_this, Floored(edge.covariance)),
                                 nullptr, Pose(side, f - 1), Pose(side, f), Scale(side));
    }
  }
  problem_->SetParameterBlockConstant(Newest(kSideM));
}

std::set<size_t> JointProblem::MutualMatches(const std::vector<PointMatch>& matches,
                                             const std::vector<bool>& use) const {
  std::set<std::array<int, 3>> pairs;  // (holder's side, its landmark, the other's landmark)
  const auto pair_of = [this](const PointMatch& match) {
    return std::array<int, 3>{HolderSide(match), match.landmark, Other(match)};
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

void JointProblem::AddMatch(const PointMatch& match, double share, ceres::LossFunction* loss,
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
  auto* factor =
      new ReprojectionFactor(host.keyframe().camera.T_body_cam, target.keyframe().camera.T_body_cam,
                             target.ray(match.observed.corner),
                             share / sigma * target.pixel_jacobian(match.observed.corner));
  double* host_pose = Pose(side, landmark.host.frame);
  double* target_pose = Pose(1 - side, match.observed.frame);
  problem_->AddResidualBlock(factor, loss, host_pose, target_pose, point);
  reprojections_.push_back({factor, host_pose, target_pose, point, share, 0});
}

}  // namespace pangea

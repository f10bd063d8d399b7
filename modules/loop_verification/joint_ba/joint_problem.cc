#include "loop_verification/joint_ba/joint_problem.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>

#include "core/least_squares/levenberg_marquardt.h"

namespace pangea {
namespace {

// Adds a small value to an odometry edge's covariance: no odometry is more accurate, and the matrix
// must be invertible.
Matrix6d Floored(const Matrix6d& covariance) {
  constexpr double kTranslation_m = 2e-4, kRotation_rad = 5e-5;
  Matrix6d floored = covariance;
  floored.diagonal().head<3>().array() += kTranslation_m * kTranslation_m;
  floored.diagonal().tail<3>().array() += kRotation_rad * kRotation_rad;
  return floored;
}

using EdgeJacobian = Eigen::Matrix<double, 6, 13>;

void AddEdge(const EdgeJacobian& J, const Vector6d& r, const std::array<int, 3>& columns,
             JointEquations* equations) {
  InformationShare::Add(J.transpose() * J, {columns.begin(), columns.end()}, 1, &equations->H);
  const Eigen::VectorXd g = J.transpose() * r;
  for (size_t block = 0; block < columns.size(); ++block) {
    if (columns[block] < equations->g.size()) {
      const int size = block + 1 < columns.size() ? 6 : 1;
      equations->g.segment(columns[block], size) += g.segment(static_cast<int>(6 * block), size);
    }
  }
}

}  // namespace

JointProblem::JointProblem(const WindowPair& windows, const Rigid3& T_m_c,
                           const JointBaOptions& options)
    : windows_{&windows.m, &windows.c}, options_(options) {
  const size_t num_frames = windows.m.frames.size() + windows.c.frames.size();
  T_body_cam_.resize(num_frames);
  state_.T_w_body.resize(num_frames);
  for (const int side : {kSideM, kSideC}) {
    const Window& window = *windows_[side];
    for (int f = 0; f <= window.newest(); ++f) {
      const int frame = Frame(side, f);
      T_body_cam_[frame] = window.keyframe(f).camera.T_body_cam;
      state_.T_w_body[frame] = side == kSideM ? window.T_w_body[f] : T_m_c * window.T_w_body[f];
      if (f > 0) {
        const OdometryEdge& edge = *window.keyframe(f).edge;
        edges_.push_back({Frame(side, f - 1), frame, side,
                          EdgeResidual(edge.T_from_this, Floored(edge.covariance))});
      }
    }
    for (const WindowLandmark& landmark : window.landmarks) {
      const Eigen::Vector2d ray = window.frames[landmark.host.frame]->ray(landmark.host.corner);
      solved_[side].emplace_back(ray.x(), ray.y(), landmark.inverse_depth);
    }
  }
}

int JointProblem::Frame(int side, int window_frame) const {
  const int num_c = windows_[kSideC]->newest() + 1;
  if (side == kSideM) {
    return num_c + window_frame;
  }
  return window_frame == num_c - 1 ? 0 : window_frame + 1;
}

// Two windows of one map share its unknown scale, so only their difference counts.
double JointProblem::ScaleSigma(int side) const {
  const Keyframe& newest = windows_[side]->newest_keyframe();
  const bool of_one_map = newest.id.map == windows_[1 - side]->newest_keyframe().id.map;
  return of_one_map ? kWindowScaleSigma
                    : std::max(kWindowScaleSigma, UnknownScaleSigma(newest.scale_sigma));
}

bool JointProblem::Solve(const std::vector<PointMatch>& matches, const std::vector<bool>& use,
                         const RobustLoss& loss) {
  points_.clear();
  state_.points.clear();
  for (const int side : {kSideM, kSideC}) {
    index_[side].assign(solved_[side].size(), -1);
  }
  const std::vector<bool> mutual = MutualMatches(matches, use);
  for (size_t i = 0; i < matches.size(); ++i) {
    if (use[i]) {
      AddMatch(matches[i], i, mutual[i] ? std::sqrt(0.5) : 1.0);
    }
  }
  columns_.clear();
  for (const HostedPoint& point : points_) {
    columns_.push_back(ColumnsOf(point));
  }
  eliminated_.resize(points_.size());
  if (!std::isfinite(Cost(state_, loss))) {
    return false;
  }
  // Stop at a predicted decrease below 0.02: a step of a fifth of a sigma in one direction.
  const LevenbergMarquardtOptions options = {.max_iterations = options_.iterations,
                                             .max_retries = 6,
                                             .min_decrease = 0.02,
                                             .tolerance = 1e-6};
  LevenbergMarquardt(
      options,
      [&](const JointState& state, double damping) { return Linearise(state, loss, damping); },
      [](const JointState&, const JointEquations& equations) {
        return SolveScaled(equations.H, equations.g);
      },
      [&](const JointEquations&, const Eigen::VectorXd& step, JointState* state) {
        Move(step, state);
      },
      [&](const JointState& state) { return Cost(state, loss); }, &state_);
  for (const int side : {kSideM, kSideC}) {
    for (size_t l = 0; l < index_[side].size(); ++l) {
      if (index_[side][l] >= 0) {
        solved_[side][l] = state_.points[index_[side][l]];
      }
    }
  }
  return true;
}

void JointProblem::AddMatch(const PointMatch& match, size_t index, double share) {
  const int side = HolderSide(match);
  const Window& holder = *windows_[side];
  const Window& observer = *windows_[1 - side];
  const WindowLandmark& landmark = holder.landmarks[match.landmark];
  int& known = index_[side][match.landmark];
  if (known < 0) {
    known = static_cast<int>(points_.size());
    const KeyframeView& host = *holder.frames[landmark.host.frame];
    const double sigma = CornerSigma(holder.corner(landmark.host), options_.pixel_sigma);
    points_.push_back({side,
                       Frame(side, landmark.host.frame),
                       host.ray(landmark.host.corner),
                       share / sigma * host.pixel_jacobian(landmark.host.corner),
                       landmark.inverse_depth,
                       landmark.inverse_depth_sigma,
                       {}});
    state_.points.push_back(solved_[side][match.landmark]);
  }
  const KeyframeView& target = *observer.frames[match.observed.frame];
  const double sigma = CornerSigma(observer.corner(match.observed), options_.pixel_sigma);
  points_[known].seen.push_back(
      {Frame(1 - side, match.observed.frame), target.ray(match.observed.corner),
       share / sigma * target.pixel_jacobian(match.observed.corner), share, index});
}

std::vector<bool> JointProblem::MutualMatches(const std::vector<PointMatch>& matches,
                                              const std::vector<bool>& use) const {
  std::set<std::array<int, 3>> pairs;  // (holder's side, its landmark, the other's landmark)
  for (size_t i = 0; i < matches.size(); ++i) {
    if (use[i]) {
      pairs.insert({HolderSide(matches[i]), matches[i].landmark, Other(matches[i])});
    }
  }
  std::vector<bool> mutual(matches.size(), false);
  for (size_t i = 0; i < matches.size(); ++i) {
    mutual[i] = use[i] && pairs.contains(
                              {1 - HolderSide(matches[i]), Other(matches[i]), matches[i].landmark});
  }
  return mutual;
}

std::vector<PosedCamera> JointProblem::Cameras(const JointState& state) const {
  std::vector<PosedCamera> cameras;
  cameras.reserve(T_body_cam_.size());
  for (size_t f = 0; f < T_body_cam_.size(); ++f) {
    cameras.emplace_back(state.T_w_body[f], T_body_cam_[f]);
  }
  return cameras;
}

double JointProblem::Cost(const JointState& state, const RobustLoss& loss) const {
  const std::vector<PosedCamera> cameras = Cameras(state);
  double cost = 0;
  for (const int side : {kSideM, kSideC}) {
    const double r = state.log_scale[side] / ScaleSigma(side);
    cost += 0.5 * r * r;
  }
  for (const Edge& edge : edges_) {
    cost += 0.5 * edge.residual
                      .Evaluate(state.T_w_body[edge.from], state.T_w_body[edge.to],
                                state.log_scale[edge.side])
                      .squaredNorm();
  }
  for (size_t p = 0; p < points_.size(); ++p) {
    cost += points_[p].Cost(state.points[p], cameras, state.log_scale[points_[p].side], loss);
  }
  return cost;
}

std::vector<int> JointProblem::ColumnsOf(const HostedPoint& point) const {
  std::vector<int> columns = {PoseColumn(point.host)};
  for (const HostedPoint::Observation& observation : point.seen) {
    columns.push_back(PoseColumn(observation.frame));
  }
  columns.push_back(ScaleColumn(point.side));
  return columns;
}

JointEquations JointProblem::Linearise(const JointState& state, const RobustLoss& loss,
                                       double damping) {
  const int n = num_columns();
  JointEquations out;
  // Without the columns of the fixed frame, which come last.
  out.H.setZero(n, n);
  out.g.setZero(n);
  for (const int side : {kSideM, kSideC}) {
    const double r = state.log_scale[side] / ScaleSigma(side);
    out.cost += 0.5 * r * r;
    const double information = 1 / (ScaleSigma(side) * ScaleSigma(side));
    out.H(ScaleColumn(side), ScaleColumn(side)) += information;
    out.g[ScaleColumn(side)] += information * state.log_scale[side];
  }
  for (const Edge& edge : edges_) {
    EdgeResidual::Jacobians jacobians;
    const Vector6d r = edge.residual.Evaluate(state.T_w_body[edge.from], state.T_w_body[edge.to],
                                              state.log_scale[edge.side], &jacobians);
    out.cost += 0.5 * r.squaredNorm();
    EdgeJacobian J;
    J << jacobians.from, jacobians.to, jacobians.scale;
    AddEdge(J, r, {PoseColumn(edge.from), PoseColumn(edge.to), ScaleColumn(edge.side)}, &out);
  }
  const std::vector<PosedCamera> cameras = Cameras(state);
  for (size_t p = 0; p < points_.size(); ++p) {
    const double kappa = state.log_scale[points_[p].side];
    Eliminate(points_[p], state.points[p], cameras, kappa, loss, damping, &eliminated_[p]);
    out.cost += eliminated_[p].cost;
    eliminated_[p].AddTo(columns_[p], &out.H, &out.g);
  }
  return out;
}

void JointProblem::Move(const Eigen::VectorXd& step, JointState* state) const {
  for (int f = 0; f + 1 < num_frames(); ++f) {
    state->T_w_body[f] = state->T_w_body[f].Plus(step.segment<6>(PoseColumn(f)));
  }
  for (const int side : {kSideM, kSideC}) {
    state->log_scale[side] += step[ScaleColumn(side)];
  }
  for (size_t p = 0; p < points_.size(); ++p) {
    state->points[p] += eliminated_[p].Step(columns_[p], step);
  }
}

void JointProblem::Classify(std::vector<bool>* inlier, double* chi2_sum) const {
  *chi2_sum = 0;
  const std::vector<PosedCamera> cameras = Cameras(state_);
  for (size_t p = 0; p < points_.size(); ++p) {
    const HostedPoint& point = points_[p];
    const double depth = point.DepthResidual(state_.points[p], state_.log_scale[point.side]);
    for (const HostedPoint::Observation& observation : point.seen) {
      const auto r = point.Residual(observation, state_.points[p], cameras);
      const double chi2 = r ? r->squaredNorm() / (observation.share * observation.share) : 0;
      const bool is_inlier =
          r && chi2 < options_.max_chi2 && depth * depth < options_.max_depth_chi2;
      (*inlier)[observation.match] = is_inlier;
      *chi2_sum += is_inlier ? chi2 : 0;
    }
  }
}

std::optional<JointProblem::Marginals> JointProblem::MarginalsOfNewestC(
    const std::vector<PointMatch>& matches, const std::vector<bool>& use,
    JointBaCovariances wanted) {
  // Without one of so many landmarks the pose is still determined.
  constexpr size_t kManyLandmarks = 8;
  JointEquations equations = Linearise(state_, {RobustLoss::Kind::kNone}, 0);
  const auto all = CovarianceOfFirst(equations.H);
  if (!all) {
    return std::nullopt;
  }
  const std::vector<JoinedPoints> landmarks = Landmarks(matches, use);
  if (wanted == JointBaCovariances::kOfAllLandmarks && landmarks.size() >= kManyLandmarks) {
    return Marginals{*all, std::nullopt, std::nullopt};
  }
  std::vector<InformationShare> shares;
  for (size_t p = 0; p < points_.size(); ++p) {
    shares.push_back({eliminated_[p].Information(), columns_[p]});
  }
  const auto without_one = CovarianceWithoutOne(equations.H, shares, landmarks);
  if (!without_one) {
    return std::nullopt;
  }
  for (const JoinedPoints& landmark : landmarks) {
    for (const int point : landmark.points) {
      if (!landmark.sure) {
        shares[point].AddTo(-1, &equations.H);
      }
    }
  }
  return Marginals{*all, without_one, CovarianceOfFirst(equations.H)};
}

std::vector<JoinedPoints> JointProblem::Landmarks(const std::vector<PointMatch>& matches,
                                                  const std::vector<bool>& use) const {
  std::vector<int> leader(points_.size());
  std::iota(leader.begin(), leader.end(), 0);
  const auto find = [&](int point) {
    while (leader[point] != point) {
      point = leader[point] = leader[leader[point]];
    }
    return point;
  };
  const DescriptorKind kind = windows_[0]->newest_keyframe().descriptor_kind;
  const int sure_hamming =
      options_.sure_hamming + LimitsOf(kind).sure - LimitsOf(DescriptorKind::kOrb).sure;
  std::vector<bool> sure(points_.size(), false);
  for (size_t i = 0; i < matches.size(); ++i) {
    const int side = HolderSide(matches[i]);
    const int own = index_[side][matches[i].landmark];
    if (!use[i] || own < 0) {
      continue;
    }
    sure[own] = sure[own] || matches[i].distance <= sure_hamming;
    const int other = Other(matches[i]) < 0 ? -1 : index_[1 - side][Other(matches[i])];
    if (other >= 0) {
      leader[find(other)] = find(own);
    }
  }
  std::vector<JoinedPoints> landmarks(points_.size());
  for (int p = 0; p < static_cast<int>(points_.size()); ++p) {
    JoinedPoints& landmark = landmarks[find(p)];
    landmark.points.push_back(p);
    landmark.sure = landmark.sure || sure[p];
  }
  std::erase_if(landmarks, [](const JoinedPoints& landmark) { return landmark.points.empty(); });
  return landmarks;
}

}  // namespace pangea

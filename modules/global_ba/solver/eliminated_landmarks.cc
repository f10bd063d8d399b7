#include "global_ba/solver/eliminated_landmarks.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/rigid3.h"

namespace pangea {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;

constexpr double kMinDepth_m = 0.05;
constexpr double kBehind = 20;  // sigmas
// Keeps a landmark that is behind all its cameras where it is.
constexpr double kMinInformation = 1e-9;  // 1/m^2

struct Linearised {
  Vector2d r;
  Matrix23 J = Matrix23::Zero();  // with respect to the landmark
};

Linearised Project(const BaObservation& seen, const EliminatedLandmarks::View& view,
                   const Vector3d& point, bool with_jacobian) {
  const Vector3d p_cam = view.R_cam_map * (point - view.p_map_cam);
  Linearised projection;
  if (!(p_cam.z() > kMinDepth_m)) {
    projection.r.setConstant(kBehind);
    return projection;
  }
  const double inverse_z = 1 / p_cam.z();
  const Vector2d xy = p_cam.head<2>() * inverse_z;
  projection.r = seen.sqrt_info * (xy - seen.ray);
  if (with_jacobian) {
    Matrix23 J_project;
    J_project << inverse_z, 0, -xy.x() * inverse_z, 0, inverse_z, -xy.y() * inverse_z;
    projection.J = seen.sqrt_info * J_project * view.R_cam_map;
  }
  return projection;
}

int MemberOf(const std::vector<int>& clique, int variable) {
  return static_cast<int>(std::ranges::lower_bound(clique, variable) - clique.begin());
}

}  // namespace

EliminatedLandmarks::View::View(const Rigid3& T_map_body, const Rigid3& T_body_cam)
    : p_map_body(T_map_body.t),
      p_map_cam(T_map_body * T_body_cam.t),
      R_map_body(T_map_body.R()),
      R_cam_map((T_map_body.q * T_body_cam.q).conjugate()) {}

EliminatedLandmarks::EliminatedLandmarks(const BaWorld& world,
                                         const std::vector<int>& pose_variables,
                                         const std::vector<int>& camera_variables)
    : cliques_(world.landmarks.size()), landmark_blocks_(world.landmarks.size()) {
  for (const BaObservation& seen : world.observations) {
    observations_.push_back({seen});
  }
  std::ranges::stable_sort(observations_, {}, [](const Observation& s) { return s.seen.landmark; });
  const auto body_of = [&](const Observation& s) { return pose_variables[s.seen.keyframe]; };
  const auto camera_of = [&](const Observation& s) {
    return camera_variables[world.keyframes[s.seen.keyframe].camera];
  };
  size_t next = 0, num_cross_blocks = 0;
  for (size_t landmark = 0; landmark < cliques_.size(); ++landmark) {
    first_observation_.push_back(next);
    std::vector<int>& clique = cliques_[landmark];
    for (; next < observations_.size() &&
           observations_[next].seen.landmark == static_cast<int>(landmark);
         ++next) {
      for (const int variable : {body_of(observations_[next]), camera_of(observations_[next])}) {
        if (variable != kFixed) {
          clique.push_back(variable);
        }
      }
    }
    std::ranges::sort(clique);
    clique.erase(std::unique(clique.begin(), clique.end()), clique.end());
    for (size_t i = first_observation_.back(); i < next; ++i) {
      const int body = body_of(observations_[i]), camera = camera_of(observations_[i]);
      observations_[i].body = body == kFixed ? kFixed : MemberOf(clique, body);
      observations_[i].camera = camera == kFixed ? kFixed : MemberOf(clique, camera);
    }
    first_cross_block_.push_back(num_cross_blocks);
    num_cross_blocks += clique.size();
  }
  first_observation_.push_back(next);
  cross_blocks_.resize(num_cross_blocks);
}

Vector2d EliminatedLandmarks::Residual(const BaObservation& seen, const View& view,
                                       const Vector3d& landmark) {
  return Project(seen, view, landmark, false).r;
}

double EliminatedLandmarks::Cost(const std::vector<View>& views,
                                 const std::vector<Vector3d>& landmarks,
                                 const RobustLoss& loss) const {
  double cost = 0;
  for (const Observation& observation : observations_) {
    const BaObservation& seen = observation.seen;
    cost += loss.Cost(Residual(seen, views[seen.keyframe], landmarks[seen.landmark]).squaredNorm());
  }
  return cost;
}

void EliminatedLandmarks::AddTo(const std::vector<View>& views,
                                const std::vector<Vector3d>& landmarks, const RobustLoss& loss,
                                BlockEquations* equations) {
  for (size_t landmark = 0; landmark < cliques_.size(); ++landmark) {
    Gather(landmark, views, landmarks[landmark], loss, equations);
  }
}

double EliminatedLandmarks::Eliminate(double damping, BlockEquations* equations) {
  double predicted_decrease = 0;
  for (size_t landmark = 0; landmark < cliques_.size(); ++landmark) {
    EliminateOne(landmark, damping, equations);
    predicted_decrease += 0.5 * landmark_blocks_[landmark].d.squaredNorm();
  }
  return predicted_decrease;
}

void EliminatedLandmarks::Gather(size_t landmark, const std::vector<View>& views,
                                 const Vector3d& point, const RobustLoss& loss,
                                 BlockEquations* equations) {
  const std::vector<int>& clique = cliques_[landmark];
  CrossBlock* const cross_blocks = cross_blocks_.data() + first_cross_block_[landmark];
  std::fill_n(cross_blocks, clique.size(), CrossBlock::Zero());
  Matrix3d information = Matrix3d::Identity() * kMinInformation;
  Vector3d gradient = Vector3d::Zero();
  for (size_t i = first_observation_[landmark]; i < first_observation_[landmark + 1]; ++i) {
    const Observation& observation = observations_[i];
    const View& view = views[observation.seen.keyframe];
    const Linearised projection = Project(observation.seen, view, point, true);
    const double sqrt_weight = std::sqrt(loss.Weight(projection.r.squaredNorm()));
    const Matrix23 J = sqrt_weight * projection.J;
    const Vector2d r = sqrt_weight * projection.r;
    information += J.transpose() * J;
    gradient += J.transpose() * r;
    const auto add = [&](int member, const Matrix26& J_variable) {
      equations->Add(landmark, member, member, J_variable.transpose() * J_variable);
      equations->g().segment<6>(equations->ColumnOf(clique[member])) += J_variable.transpose() * r;
      cross_blocks[member] += J.transpose() * J_variable;
    };
    Matrix26 J_body, J_camera;
    if (observation.body != kFixed) {
      J_body << -J, J * Hat(point - view.p_map_body);
      add(observation.body, J_body);
    }
    if (observation.camera != kFixed) {
      J_camera << -J * view.R_map_body, J * Hat(point - view.p_map_cam) * view.R_map_body;
      add(observation.camera, J_camera);
    }
    if (observation.body != kFixed && observation.camera != kFixed) {
      equations->Add(landmark, observation.camera, observation.body, J_camera.transpose() * J_body);
    }
  }
  landmark_blocks_[landmark] = {information, gradient};
}

void EliminatedLandmarks::EliminateOne(size_t landmark, double damping, BlockEquations* equations) {
  const std::vector<int>& clique = cliques_[landmark];
  CrossBlock* const cross_blocks = cross_blocks_.data() + first_cross_block_[landmark];
  LandmarkBlock& block = landmark_blocks_[landmark];
  block.L.diagonal() *= 1 + damping;
  block.L = block.L.llt().matrixL();
  const auto L = block.L.triangularView<Eigen::Lower>();
  L.solveInPlace(block.d);
  for (size_t a = 0; a < clique.size(); ++a) {
    L.solveInPlace(cross_blocks[a]);
    for (size_t b = 0; b <= a; ++b) {
      equations->Add(landmark, a, b, -(cross_blocks[a].transpose() * cross_blocks[b]));
    }
    equations->g().segment<6>(equations->ColumnOf(clique[a])) -=
        cross_blocks[a].transpose() * block.d;
  }
}

void EliminatedLandmarks::Move(const Eigen::VectorXd& step, const BlockEquations& equations,
                               std::vector<Vector3d>* landmarks) const {
  for (size_t landmark = 0; landmark < cliques_.size(); ++landmark) {
    Vector3d moved = landmark_blocks_[landmark].d;
    for (size_t member = 0; member < cliques_[landmark].size(); ++member) {
      moved += cross_blocks_[first_cross_block_[landmark] + member] *
               step.segment<6>(equations.ColumnOf(cliques_[landmark][member]));
    }
    landmark_blocks_[landmark].L.transpose().triangularView<Eigen::Upper>().solveInPlace(moved);
    (*landmarks)[landmark] -= moved;
  }
}

}  // namespace pangea

#pragma once

// The landmarks of a bundle adjustment, eliminated (Schur complement; Triggs et al., 2000, section
// 6.1).
//
// A landmark p in the map frame, seen by a camera of a body: r = S (pi(T_cam_map p) - ray), under a
// robust loss by iterated reweighting. With J its derivative by p, those by the errors of the
// poses T_map_body and T_body_cam, (dp, dtheta) on the left, are
//
//   J_body = -J [I, -[p - p_map_body]x],   J_cam = -J [I, -[p - p_map_cam]x] diag(R_map_body).
//
// Behind the camera there is no ray: the residual of an outlier, without a slope, so that one
// landmark does not hold up all others.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "core/least_squares/robust_loss.h"
#include "global_ba/ba_world.h"
#include "least_squares/block_equations.h"

namespace pangea {

class EliminatedLandmarks {
 public:
  // A camera where the adjustment has it.
  struct View {
    View(const Rigid3& T_map_body, const Rigid3& T_body_cam);

    Eigen::Vector3d p_map_body, p_map_cam;
    Eigen::Matrix3d R_map_body, R_cam_map;
  };

  // Of each keyframe's pose and each camera the variable, -1 for what is held. Cameras' come after
  // all poses'.
  EliminatedLandmarks(const BaWorld& world, const std::vector<int>& pose_variables,
                      const std::vector<int>& camera_variables);

  // Of each landmark the variables that see it.
  const std::vector<std::vector<int>>& cliques() const { return cliques_; }

  // Whitened.
  static Eigen::Vector2d Residual(const BaObservation& seen, const View& view,
                                  const Eigen::Vector3d& landmark);
  // `views`: of each keyframe.
  double Cost(const std::vector<View>& views, const std::vector<Eigen::Vector3d>& landmarks,
              const RobustLoss& loss) const;

  // Adds what they say of the variables to the equations, whose cliques begin with these.
  void AddTo(const std::vector<View>& views, const std::vector<Eigen::Vector3d>& landmarks,
             const RobustLoss& loss, BlockEquations* equations);
  // Then takes from the equations what the landmarks need for themselves. `damping`:
  // Levenberg-Marquardt's. Returns by how much their own steps should lower the cost.
  double Eliminate(double damping, BlockEquations* equations);
  // Their own steps for the step of all variables, by the last elimination.
  void Move(const Eigen::VectorXd& step, const BlockEquations& equations,
            std::vector<Eigen::Vector3d>* landmarks) const;

 private:
  static constexpr int kHeld = -1;
  struct Observation {
    BaObservation seen;
    int body = kHeld, camera = kHeld;  // members of the landmark's clique
  };
  // L L^T is the landmark's own information; L^-1 times its gradient.
  struct LandmarkBlock {
    Eigen::Matrix3d L;
    Eigen::Vector3d d;
  };
  using CrossBlock = Eigen::Matrix<double, 3, 6>;  // L^-1 times its information with a variable

  void Gather(size_t landmark, const std::vector<View>& views, const Eigen::Vector3d& point,
              const RobustLoss& loss, BlockEquations* equations);
  void EliminateOne(size_t landmark, double damping, BlockEquations* equations);

  std::vector<Observation> observations_;  // landmark by landmark
  std::vector<size_t> first_observation_;  // of each landmark; and their number
  std::vector<std::vector<int>> cliques_;
  std::vector<size_t> first_cross_block_;  // of each landmark
  std::vector<CrossBlock> cross_blocks_;   // of each member of each clique
  std::vector<LandmarkBlock> landmark_blocks_;
};

}  // namespace pangea

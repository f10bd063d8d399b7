#pragma once

// The landmarks of a bundle adjustment, eliminated (Schur complement; Triggs et al., 2000, section
// 6.1).
//
// A landmark p in the map frame, seen by a camera of a body: r = S (pi(T_cam_map p) - ray), with a
// robust loss by iterated reweighting. With J its derivative with respect to p, those with respect
// to the errors of the poses T_map_body and T_body_cam, (dp, dtheta) on the left, are
//
//   J_body = -J [I, -[p - p_map_body]x],   J_cam = -J [I, -[p - p_map_cam]x] diag(R_map_body).
//
// For a landmark behind the camera the residual is a constant, that of an outlier, so that one
// landmark does not stop the optimisation.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "block_equations/block_equations.h"
#include "core/least_squares/robust_loss.h"
#include "global_ba/ba_world.h"

namespace pangea {

class EliminatedLandmarks {
 public:
  // Pose of a camera at the present estimate.
  struct View {
    View(const Rigid3& T_map_body, const Rigid3& T_body_cam);

    Eigen::Vector3d p_map_body, p_map_cam;
    Eigen::Matrix3d R_map_body, R_cam_map;
  };

  // `pose_variables`, `camera_variables`: variable of each keyframe's pose and of each camera; -1:
  // fixed. The cameras' variables come after all poses'.
  EliminatedLandmarks(const BaWorld& world, const std::vector<int>& pose_variables,
                      const std::vector<int>& camera_variables);

  // By landmark: the variables that its observations involve.
  const std::vector<std::vector<int>>& cliques() const { return cliques_; }

  // Whitened residual.
  static Eigen::Vector2d Residual(const BaObservation& seen, const View& view,
                                  const Eigen::Vector3d& landmark);
  // `views`: one per keyframe.
  double Cost(const std::vector<View>& views, const std::vector<Eigen::Vector3d>& landmarks,
              const RobustLoss& loss) const;

  // Adds the observations to the equations. The first cliques of the equations must be cliques().
  void AddTo(const std::vector<View>& views, const std::vector<Eigen::Vector3d>& landmarks,
             const RobustLoss& loss, BlockEquations* equations);
  // Call after AddTo: subtracts the Schur complement of the landmarks. `damping`: of
  // Levenberg-Marquardt. Returns the predicted decrease of the cost by the landmarks' own steps.
  double Eliminate(double damping, BlockEquations* equations);
  // Moves the landmarks for a step of all variables, with the last elimination.
  void Move(const Eigen::VectorXd& step, const BlockEquations& equations,
            std::vector<Eigen::Vector3d>* landmarks) const;

 private:
  static constexpr int kFixed = -1;
  struct Observation {
    BaObservation seen;
    int body = kFixed, camera = kFixed;  // indices in the landmark's clique
  };
  // L L^T: the landmark's own information matrix; d: L^-1 times its gradient.
  struct LandmarkBlock {
    Eigen::Matrix3d L;
    Eigen::Vector3d d;
  };
  // L^-1 times the cross information with a variable
  using CrossBlock = Eigen::Matrix<double, 3, 6>;

  void Gather(size_t landmark, const std::vector<View>& views, const Eigen::Vector3d& point,
              const RobustLoss& loss, BlockEquations* equations);
  void EliminateOne(size_t landmark, double damping, BlockEquations* equations);

  std::vector<Observation> observations_;  // ordered by landmark
  std::vector<size_t> first_observation_;  // by landmark; last entry: the total number
  std::vector<std::vector<int>> cliques_;
  std::vector<size_t> first_cross_block_;  // by landmark
  std::vector<CrossBlock> cross_blocks_;   // one per member of each clique
  std::vector<LandmarkBlock> landmark_blocks_;
};

}  // namespace pangea

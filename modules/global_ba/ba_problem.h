#pragma once

// The visual-inertial bundle adjustment of one group:
//
//   min  sum_seen rho(|r_landmark|^2) + sum_keyframes ((1 - w) |r_inertial|^2 + w |r_edge|^2)
//        + sum_maps |r_bias|^2 + |r_camera|^2 + |r_scale|^2
//
// over every keyframe's pose, velocity and biases, every landmark, and the extrinsics of each map's
// camera (ba_factors.h): an odometry refines them while it runs, so early keyframes were made with
// a poorer estimate than late ones.
//
// An odometry edge comes from the same samples and rays, and from many more images between the
// keyframes: without it the adjustment would have less information on a map than its odometry. The
// correlation of their errors is unknown, so the two are weighted by covariance intersection
// (Julier and Uhlmann, 1997), which is consistent for any correlation. An edge without an inertial
// measurement beside it has its full weight. The edges of a map share an error of scale that their
// covariances do not contain: it is one unknown per map (ScalePriorFactor), with the odometry's own
// sigma if the map is not metric.
//
// Two rounds of Levenberg-Marquardt (solver/ba_solver.h): the first, with Cauchy's loss, finds the
// outliers, which are dropped; the second, with Huber's loss, estimates the rest. Position and yaw
// of the whole are unobservable: damping keeps them at their initial values.
//
// Fixed variables (`fixed`) keep their values, and the cost is minimised over the others. So a
// world at its minimum stays there, whichever variables are fixed.
//
// The work is done in pieces of a few iterations, so that the caller can handle messages in between
// or abandon it. One thread, no clock: the same world gives the same bytes.

#include <memory>

#include "global_ba/ba_world.h"
#include "global_ba/solver/ba_solver.h"

namespace pangea {

class BaProblem {
 public:
  BaProblem(BaWorld world, const BaOptions& options);
  BaProblem(const BaProblem&) = delete;
  BaProblem& operator=(const BaProblem&) = delete;

  // Does the next piece of work; false if none is left.
  bool Advance();

  // The present estimate.
  const BaWorld& world() const { return world_; }
  // Cost of the last solve, over all residuals; zero before the first.
  double cost() const { return cost_; }
  int iterations() const { return iterations_; }

 private:
  enum class Round { kFindOutliers, kEstimate, kDone };

  void Begin();
  void DropOutliers();

  BaOptions options_;
  BaWorld world_;
  Round round_ = Round::kFindOutliers;
  std::unique_ptr<BaSolver> solver_;
  double cost_ = 0;
  int iterations_ = 0;  // of this round
};

}  // namespace pangea

#pragma once

// The visual-inertial bundle adjustment of one group:
//
//   min  sum_seen rho(|r_landmark|^2) + sum_keyframes ((1 - w) |r_inertial|^2 + w |r_edge|^2)
//        + sum_maps |r_bias|^2 + |r_camera|^2 + |r_scale|^2
//
// over every keyframe's pose, velocity and biases, every landmark, and where each map's camera sits
// on its IMU (ba_factors.h): an odometry finds that on its way, so early keyframes were made with a
// poorer estimate than late ones.
//
// An odometry edge was made of the same samples and rays, and of many images more between the
// keyframes: without it the adjustment knows less of a map than its odometry did. How much of their
// errors the two share is not known, so they are weighted as covariance intersection does (Julier
// and Uhlmann, 1997), which holds whatever they share. The edges of a map have their scale's error
// in common, as none of their covariances can say: it is one unknown a map (ScalePriorFactor), with
// the odometry's own sigma where a map is not metric.
//
// Two rounds of Levenberg-Marquardt (solver/ba_solver.h): with Cauchy's loss what does not fit
// shows and is dropped, with Huber's the rest is estimated.
// Position and yaw of the whole are free: damping leaves them where they began.
//
// What is held stays as it is: then it is the minimum over the rest alone. A world that is at its
// minimum therefore stays there, whatever of it is held.
//
// In pieces of a few iterations, so that whoever runs it may look up in between and drop it. One
// thread, no clock: the same world gives the same bytes.

#include <memory>

#include "global_ba/ba_world.h"
#include "global_ba/solver/ba_solver.h"

namespace pangea {

class BaProblem {
 public:
  BaProblem(BaWorld world, const BaOptions& options);
  BaProblem(const BaProblem&) = delete;
  BaProblem& operator=(const BaProblem&) = delete;

  // The next piece of work; false when there is none left.
  bool Advance();

  // As it stands.
  const BaWorld& world() const { return world_; }
  // The last solve's, over all residuals; zero before.
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

#pragma once

// Removes keyframes from a pose graph: the factors at them become factors between those that stay.
//
// When a keyframe is removed, one of its neighbours becomes the hub; each other neighbour is
// connected to the hub by composing its two factors through the removed keyframe. The exact
// marginal of a star of independent relative poses is dense. This tree approximates it, and has the
// exact marginal relative pose between the hub and each neighbour. If the hub is the neighbour with
// the smallest covariance, it is the Chow-Liu tree (Kretzschmar & Stachniss, IJRR 2012;
// Carlevaris-Bianco & Eustice, ICRA 2013 and TRO 2014). With two neighbours it is the exact
// marginal. The number of factors never grows; two factors between the same keyframes are averaged.
//
// Deterministic: the same calls in the same order give the same factors.

#include <map>
#include <set>
#include <vector>

#include "core/ids.h"
#include "core/server_messages.h"
#include "thinning/relative_pose.h"

namespace pangea {

class NodeRemoval {
 public:
  struct Factor {
    RelativePose relative;
    bool odometry = false;  // an odometry edge
    bool derived = false;   // not an original factor
    // Statistics of the weakest measurement in a composition, and of the strongest one in an
    // average.
    int num_inliers = 0;
    double inlier_ratio = 0;
    double rms_px = 0;
  };

  // `from`, `to`: successive keyframes of a map.
  void AddOdometry(const KeyframeId& from, const KeyframeId& to, const RelativePose& relative);
  void AddConstraint(const Constraint& constraint);

  // Removes successive keyframes of a map from which other keyframes stay. The hub is the nearer
  // end of the gap in the same map, so that the odometry chain remains connected.
  void RemoveRun(const std::vector<KeyframeId>& run);
  // Removes all keyframes of maps from which none stays; in any order.
  void RemoveMaps(const std::set<KeyframeId>& keyframes);

  using Neighbours = std::map<KeyframeId, Factor>;
  // Each factor is stored at both its keyframes, as the relative pose from that keyframe.
  const std::map<KeyframeId, Neighbours>& factors() const { return factors_; }

 private:
  void Put(const KeyframeId& from, const KeyframeId& to, const Factor& factor);
  // The hub is an end of the run's gap (`along_the_map`), or the neighbour with the smallest
  // covariance.
  void Remove(const KeyframeId& id, bool along_the_map);
  KeyframeId Hub(const Neighbours& neighbours, bool along_the_map) const;

  std::map<KeyframeId, Neighbours> factors_;
  std::set<KeyframeId> going_;  // of the run being removed
};

}  // namespace pangea

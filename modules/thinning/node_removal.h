#pragma once

// Takes keyframes out of a pose graph; what was measured to them becomes factors between those that
// stay.
//
// Of the factors at a keyframe that goes, one neighbour is the hub; each other neighbour is joined
// to the hub through the keyframe that goes, by composing two factors. The marginal of a star of
// independent relative poses is dense; this is the tree among its approximations that has the
// marginal's relative pose to the hub exactly, for each neighbour. With the best known neighbour as
// the hub it is the Chow-Liu tree (Kretzschmar & Stachniss, IJRR 2012; Carlevaris-Bianco & Eustice,
// ICRA 2013 and TRO 2014). With two neighbours it is the marginal. The number of factors never
// grows; two between the same keyframes are averaged.
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
    bool odometry = false;  // along a map
    bool derived = false;   // not as it was added
    // Of the weakest measurement it is composed of, of the strongest it is averaged of.
    int num_inliers = 0;
    double inlier_ratio = 0;
    double rms_px = 0;
  };

  // Between keyframes that follow each other in a map.
  void AddOdometry(const KeyframeId& from, const KeyframeId& to, const RelativePose& relative);
  void AddConstraint(const Constraint& constraint);

  // Keyframes of one map that follow each other, of a map of which others stay: the hub is on the
  // map itself, the nearer end of the gap, so that the odometry's chain stays one.
  void RemoveRun(const std::vector<KeyframeId>& run);
  // All keyframes of maps of which none stays, in any order.
  void RemoveMaps(const std::set<KeyframeId>& keyframes);

  using Neighbours = std::map<KeyframeId, Factor>;
  // Each factor stands at both its keyframes, from the one it stands at.
  const std::map<KeyframeId, Neighbours>& factors() const { return factors_; }

 private:
  void Put(const KeyframeId& from, const KeyframeId& to, const Factor& factor);
  // An end of the run's gap is the hub, or the best known neighbour.
  void Remove(const KeyframeId& id, bool along_the_map);
  KeyframeId Hub(const Neighbours& neighbours, bool along_the_map) const;

  std::map<KeyframeId, Neighbours> factors_;
  std::set<KeyframeId> going_;  // of the run in work
};

}  // namespace pangea

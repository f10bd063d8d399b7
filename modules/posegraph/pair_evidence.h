#pragma once

// Are two maps one place? The evidence for one pair of maps, and the decision.
//
// Each accepted constraint between the maps is a candidate alignment T_odom_a_odom_b. Two
// candidates agree when the cycle through them and both maps' odometry closes within its covariance
// (pairwise consistency: Mangelson et al., ICRA 2018; Mahalanobis distance, four degrees of
// freedom). The largest set that agrees mutually carries the merge if it is large enough, was not
// all won by one viewpoint, and its best rival is clearly smaller. A constraint that thinning
// derived stands for evidence that was enough once: it counts as the most that is ever asked for. A
// pure function of the evidence: not of its order, and a merge once made is unmade when a rival
// grows.

#include <cstdint>
#include <optional>
#include <vector>

#include "posegraph/loop.h"
#include "posegraph/odometry_chain.h"

namespace pangea {

struct MergeOptions {
  // Viewpoints that must agree: constraints that differ by a keyframe elsewhere, in either map.
  int min_viewpoints = 3;
  // So few are enough if each has this many inliers.
  int min_strong_viewpoints = 2;
  int strong_inliers = 80;
  // A keyframe is elsewhere by this distance or this rotation of the view.
  double viewpoint_distance_m = 0.25;
  double viewpoint_angle = 0.15;
  // What the agreeing viewpoints see must not be one spot: an object has a look-alike somewhere.
  // Agents that only ever looked at one spot need one viewpoint more, and next to no rival:
  // look-alikes standing elsewhere would each be one.
  double min_scene_extent_m = 1.5;
  double max_rival_share_at_one_spot = 0.25;
  // The largest rival may have this share of the viewpoints.
  double max_rival_share = 0.5;
  double agree_chi2 = 18.47;  // chi-squared(4): 0.999
  // Odometry that claims less drift than this is not believed while maps are compared (it is no
  // weight of the solve): standard deviations per metre of path.
  double min_drift_per_m = 0.02;
  double min_yaw_drift_per_m = 0.001;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("min_viewpoints", &min_viewpoints, {1, 1000}, "", "that must agree");
    archive.Add("min_strong_viewpoints", &min_strong_viewpoints, {1, 1000}, "",
                "that are enough, if each is strong");
    archive.Add("strong_inliers", &strong_inliers, {4, 100000}, "", "of a strong viewpoint");
    archive.Add("viewpoint_distance_m", &viewpoint_distance_m, {0, 1000}, "m",
                "by which a keyframe is another viewpoint");
    archive.Add("viewpoint_angle", &viewpoint_angle, {0, 3.15}, "rad",
                "by which a keyframe is another viewpoint");
    archive.Add("min_scene_extent_m", &min_scene_extent_m, {0, 1000}, "m",
                "of what the agreeing viewpoints see; less is one spot");
    archive.Add("max_rival_share_at_one_spot", &max_rival_share_at_one_spot, {0, 1}, "",
                "of the viewpoints, where all see one spot");
    archive.Add("max_rival_share", &max_rival_share, {0, 1}, "", "of the viewpoints");
    archive.Add("agree_chi2", &agree_chi2, {0.1, 1000}, "",
                "of two constraints that agree, 4 degrees of freedom");
    archive.Add("min_drift_per_m", &min_drift_per_m, {0, 1}, "",
                "sigma of the odometry, of its path, while maps are compared");
    archive.Add("min_yaw_drift_per_m", &min_yaw_drift_per_m, {0, 1}, "rad/m",
                "sigma of the odometry's yaw, while maps are compared");
  }
};

// Covariance of the odometry between two nodes of a map, at a point, with the options' least drift
// added.
Matrix4d BelievableDrift(const OdometryChain& chain, int i, int j, const Eigen::Vector3d& point,
                         const MergeOptions& options);

class PairEvidence {
 public:
  PairEvidence(const OdometryChain& a, const OdometryChain& b, const MergeOptions& options)
      : a_(&a), b_(&b), options_(options) {}

  struct Measurement {
    int64_t id = 0;
    int node_a = 0, node_b = 0;
    Relative4 relative;  // from node_a of map a to node_b of map b
    int num_inliers = 0;
    bool derived = false;  // as Loop has it
  };
  void Add(const Measurement& measurement);

  void Save(ByteWriter* writer) const;
  // Of the same two maps. False if these are not the bytes of their evidence.
  bool Restore(ByteReader* reader);

  struct Decision {
    bool merge = false;
    std::vector<int64_t> agreeing;  // constraint ids, ascending
    int viewpoints = 0;
    int rival_viewpoints = 0;
  };
  const Decision& decision() const { return decision_; }
  // Averaged over the agreeing candidates; only after a decision to merge.
  Pose4 Alignment() const;

  // What the agreeing candidates say of the odometry: the error of each against the one half of
  // them further along map a, and the covariances it is made of (measurements, odometry). No
  // candidate is in two, so that one that is off does not speak for all.
  struct Innovation {
    Vector4d error;
    Matrix4d measurement;
    Matrix4d odometry;
  };
  std::vector<Innovation> Innovations() const;

 private:
  struct Candidate : Measurement {
    Pose4 T_odom_a_odom_b;
    std::vector<bool> agrees;  // with each candidate before it
  };

  Innovation Compare(const Candidate& k, const Candidate& l, const MergeOptions& drift) const;
  bool Agree(const Candidate& k, const Candidate& l) const;
  bool AgreeAt(int k, int l) const;
  // Greedy largest set of mutually agreeing candidates among `among`.
  std::vector<int> LargestAgreeing(std::vector<int> among) const;
  std::vector<int> Viewpoints(const std::vector<int>& candidates) const;
  double SceneExtent(const std::vector<int>& candidates) const;
  bool Enough(const std::vector<int>& viewpoints, int rival_viewpoints) const;
  bool DifferentViewpoint(const Candidate& k, const Candidate& l) const;
  int BestMember(const std::vector<int>& agreeing) const;
  void Decide();

  const OdometryChain* a_;
  const OdometryChain* b_;
  MergeOptions options_;
  std::vector<Candidate> candidates_;  // in the order they came
  std::vector<int> agreeing_;
  Decision decision_;
};

}  // namespace pangea

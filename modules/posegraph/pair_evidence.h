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
  // What the agreeing viewpoints see must not be one spot: an object has a look-alike somewhere.
  // Agents that only ever looked at one spot need one viewpoint more, and next to no rival:
  // look-alikes standing elsewhere would each be one.
  double min_scene_extent_m = 1.5;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("min_scene_extent_m", &min_scene_extent_m, {0, 1000}, "m",
                "of what the agreeing viewpoints see; less is one spot");
  }
};

// Covariance of the odometry between two nodes of a map, at a point, with the least drift added
// that is believed while maps are compared.
Matrix4d BelievableDrift(const OdometryChain& chain, int i, int j, const Eigen::Vector3d& point);

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

  // What the odometry is believed to drift.
  enum class Drift : uint8_t { kAsClaimed, kBelievable };
  Innovation Compare(const Candidate& k, const Candidate& l,
                     Drift drift = Drift::kBelievable) const;
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

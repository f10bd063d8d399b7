#pragma once

// Collects the evidence that two maps overlap, and decides whether to merge them.
//
// Each accepted constraint between the maps is a candidate alignment T_odom_a_odom_b. Two
// candidates agree when the cycle through them and both maps' odometry closes within its covariance
// (pairwise consistency: Mangelson et al., ICRA 2018; Mahalanobis distance, four degrees of
// freedom). The largest mutually consistent set is the hypothesis. A candidate is its rival if it
// says that the map is elsewhere; one that is only less accurate than it claims supports the
// hypothesis. The maps are merged if the consistent set is large enough, does not come from a
// single viewpoint, and its best rival set is clearly smaller. A merge ends when rivals outweigh
// what supports it: what undoes it is as much evidence as it rests on. A constraint
// that thinning derived replaces constraints that once sufficed for a merge, so it counts as
// sufficient evidence by itself; the test against rivals remains. So does one by a tag that both
// keyframes see: a tag has an identity, and no look-alikes.
//
// At most 600 candidates are compared. If these merge the maps, the decision is final, and a later
// constraint that agrees with all agreeing ones is one of them. If not, the oldest are forgotten.

#include <cstdint>
#include <optional>
#include <vector>

#include "posegraph/loop.h"
#include "posegraph/odometry_chain.h"

namespace pangea {

struct MergeOptions {
  // The agreeing viewpoints must see scenes at least this far apart: a single object may have a
  // look-alike elsewhere. If all agents looked at one spot only, one more viewpoint is required and
  // nearly no rival: each look-alike elsewhere would be a rival.
  double min_scene_extent_m = 1.5;

  template <typename Archive>
  void Visit(Archive& archive) {
    archive.Add("min_scene_extent_m", &min_scene_extent_m, {0, 1000}, "m",
                "of what the agreeing viewpoints see; less is one spot");
  }
};

// Drift covariance of the odometry between nodes i and j, at a point (OdometryChain::DriftBetween),
// plus a minimum drift: while maps are compared, no odometry is trusted further than that.
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
    bool sufficient = false;  // as in Loop
  };
  void Add(const Measurement& measurement);

  void Save(ByteWriter* writer) const;
  // For the evidence of the same two maps. False if the bytes are not those of a PairEvidence.
  bool Restore(ByteReader* reader);

  struct Decision {
    bool merge = false;
    std::vector<int64_t> agreeing;  // constraint ids, ascending
    int viewpoints = 0;             // of these
    int rival_viewpoints = 0;
  };
  const Decision& decision() const { return decision_; }
  // Averaged over the agreeing candidates; only after a decision to merge.
  Pose4 Alignment() const;
  // Of the agreeing candidate whose keyframe of map a is nearest to this node; only after a
  // decision to merge.
  struct AgreeingCandidate {
    int node_a = 0, node_b = 0;
    Pose4 T_odom_a_odom_b;
    double sigma_m = 0;  // of the position, in the worst direction
  };
  AgreeingCandidate AgreeingNear(int node_a) const;
  // Whether an agreeing candidate suffices for a merge by itself.
  bool HasSufficient() const;

  // Samples of the odometry's error, from the agreeing candidates: the candidates are sorted along
  // map a, and candidate i is compared with candidate i + n/2, rounded up: of three, the outer two.
  // Each is used at most once, so that a single wrong one does not affect all samples.
  // `measurement` and `odometry` are the two parts of the covariance of `error`.
  struct Innovation {
    Vector4d error;
    Matrix4d measurement;
    Matrix4d odometry;
  };
  std::vector<Innovation> Innovations() const;

 private:
  enum class Agreement : uint8_t {
    kContradict,  // the map is elsewhere
    kNearly,      // at the same place, but less accurate than claimed
    kAgree,
  };
  struct Candidate : Measurement {
    Pose4 T_odom_a_odom_b;
    std::vector<Agreement> agreement;  // with each earlier candidate
  };

  // kAsClaimed: the drift that the covariances state. kBelievable: with BelievableDrift's minimum.
  enum class Drift : uint8_t { kAsClaimed, kBelievable };
  Innovation Compare(const Candidate& k, const Candidate& l,
                     Drift drift = Drift::kBelievable) const;
  Agreement Predicts(const Candidate& l, const Candidate& k) const;
  Agreement AgreementOf(const Candidate& k, const Candidate& l) const;
  Agreement AgreementAt(int k, int l) const;
  bool AgreeAt(int k, int l) const { return AgreementAt(k, l) == Agreement::kAgree; }
  // Greedy largest set of mutually agreeing candidates among `among`.
  std::vector<int> LargestAgreeing(std::vector<int> among) const;
  std::vector<int> Viewpoints(const std::vector<int>& candidates) const;
  double SceneExtent(const std::vector<int>& candidates) const;
  bool IsRival(int candidate) const;
  bool Enough(const std::vector<int>& viewpoints, int rival_viewpoints) const;
  bool DifferentViewpoint(const Candidate& k, const Candidate& l) const;
  int BestMember(const std::vector<int>& agreeing) const;
  void AddToMerge(const Candidate& candidate);
  void ForgetOldest();
  void Decide();

  const OdometryChain* a_;
  const OdometryChain* b_;
  MergeOptions options_;
  std::vector<Candidate> candidates_;  // in order of arrival
  std::vector<int> agreeing_;
  Decision decision_;
};

}  // namespace pangea

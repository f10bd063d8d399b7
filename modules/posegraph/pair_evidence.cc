#include "posegraph/pair_evidence.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <tuple>
#include <utility>

#include "posegraph/solver/four_dof_record.h"

namespace pangea {
namespace {

// Each new candidate is compared with all others, so their number is bounded.
constexpr size_t kMaxCandidates = 600;
constexpr size_t kMaxSeeds = 10;
constexpr size_t kMaxCompared = 40;

// Number of viewpoints that must agree: constraints are different viewpoints if their keyframes are
// elsewhere in either map. Fewer are enough if each has kStrongInliers inliers.
constexpr int kMinViewpoints = 3;
constexpr int kMinStrongViewpoints = 2;
constexpr int kStrongInliers = 80;
// A keyframe is elsewhere if it is further away than this, or if its view is rotated by more than
// this.
constexpr double kViewpointDistance_m = 0.25;
constexpr double kViewpointAngle_rad = 0.15;
// Largest share, of the agreeing viewpoints, that the best rival set may have.
constexpr double kMaxRivalShare = 0.5;
constexpr double kMaxRivalShareAtOneSpot = 0.25;
// A constraint's covariance is up to this many times too small on real images (NEES, bench/README),
// so a candidate that fits with one so much larger is no rival.
constexpr double kMaxNees = 10;
// Minimum drift while maps are compared, as standard deviations per metre of path. It has no effect
// on the weights of the solve.
constexpr double kMinDrift_per_m = 0.02;
constexpr double kMinYawDrift_rad_per_m = 0.001;

Matrix4d RotateAxes(const Matrix4d& covariance, double yaw) {
  Matrix4d R = Matrix4d::Identity();
  R.topLeftCorner<3, 3>() = YawRotation(yaw).toRotationMatrix();
  return R * covariance * R.transpose();
}

bool Elsewhere(const OdometryChain::Node& k, const OdometryChain::Node& l) {
  const Eigen::Vector3d view_k = (k.scene_odom - k.T_odom_body.t).normalized();
  const Eigen::Vector3d view_l = (l.scene_odom - l.T_odom_body.t).normalized();
  return (k.T_odom_body.t - l.T_odom_body.t).norm() > kViewpointDistance_m ||
         view_k.dot(view_l) < std::cos(kViewpointAngle_rad);
}

// Covariance, from the unknown scale of the map of keyframes k and l, of a position `from_l` away
// from node l.
Eigen::Matrix3d ScaleCovariance(const OdometryChain::Node& k, const OdometryChain::Node& l,
                                const Eigen::Vector3d& from_l) {
  const double sigma = UnknownScaleSigma(std::max(k.scale_sigma, l.scale_sigma));
  return sigma * sigma * from_l * from_l.transpose();
}

}  // namespace

Matrix4d BelievableDrift(const OdometryChain& chain, int i, int j, const Eigen::Vector3d& point) {
  const double path = chain.PathBetween(i, j);
  const double sigma_m = kMinDrift_per_m * path;
  const double sigma_yaw = kMinYawDrift_rad_per_m * path;
  Matrix4d least = Matrix4d::Identity() * sigma_m * sigma_m;
  least(3, 3) = sigma_yaw * sigma_yaw;
  return chain.DriftBetween(i, j, point) + CovarianceAt(least, point - chain[j].T_odom_body.t);
}

PairEvidence::Innovation PairEvidence::Compare(const Candidate& k, const Candidate& l,
                                               Drift drift) const {
  const auto drift_between = [&](const OdometryChain& chain, int i, int j,
                                 const Eigen::Vector3d& point) {
    return drift == Drift::kBelievable ? BelievableDrift(chain, i, j, point)
                                       : chain.DriftBetween(i, j, point);
  };
  // Position of k's keyframe of map b as l and the odometry of both maps predict it, in the odom
  // axes of a.
  const Eigen::Vector3d& p_b = (*b_)[k.node_b].T_odom_body.t;
  const Eigen::Vector3d p_a = l.T_odom_a_odom_b * p_b;
  const Eigen::Vector3d& from_k = (*a_)[k.node_a].T_odom_body.t;
  const Eigen::Vector3d to_l = (*a_)[l.node_a].T_odom_body.t + l.relative.t;
  Innovation innovation;
  innovation.error << from_k + k.relative.t - p_a, WrapAngle(k.relative.yaw - l.relative.yaw);
  innovation.measurement = k.relative.covariance + CovarianceAt(l.relative.covariance, p_a - to_l);
  innovation.measurement.topLeftCorner<3, 3>() +=
      ScaleCovariance((*a_)[k.node_a], (*a_)[l.node_a], from_k - (*a_)[l.node_a].T_odom_body.t) +
      ScaleCovariance((*b_)[k.node_b], (*b_)[l.node_b], p_a - to_l);
  innovation.odometry = drift_between(*a_, k.node_a, l.node_a, p_a) +
                        RotateAxes(drift_between(*b_, l.node_b, k.node_b, p_b), l.relative.yaw);
  return innovation;
}

PairEvidence::Agreement PairEvidence::Predicts(const Candidate& l, const Candidate& k) const {
  const Innovation innovation = Compare(k, l);
  const auto fits = [&](double inflation) {
    const Matrix4d covariance = inflation * innovation.measurement + innovation.odometry;
    return innovation.error.dot(covariance.ldlt().solve(innovation.error)) <= kMaxLoopChi2;
  };
  return fits(1) ? Agreement::kAgree : fits(kMaxNees) ? Agreement::kNearly : Agreement::kContradict;
}

// Tests both directions, so that the result does not depend on the order of arrival.
PairEvidence::Agreement PairEvidence::AgreementOf(const Candidate& k, const Candidate& l) const {
  return std::min(Predicts(l, k), Predicts(k, l));
}

PairEvidence::Agreement PairEvidence::AgreementAt(int k, int l) const {
  return k == l ? Agreement::kAgree : candidates_[std::max(k, l)].agreement[std::min(k, l)];
}

void PairEvidence::Add(const Measurement& measurement) {
  Candidate candidate{measurement, {}, {}};
  const Relative4& relative = measurement.relative;
  const Eigen::Vector3d& p_a = (*a_)[measurement.node_a].T_odom_body.t;
  const Eigen::Vector3d& p_b = (*b_)[measurement.node_b].T_odom_body.t;
  candidate.T_odom_a_odom_b = {p_a + relative.t - YawRotation(relative.yaw) * p_b, relative.yaw};
  if (candidates_.size() >= kMaxCandidates) {
    if (decision_.merge) {
      return AddToMerge(candidate);
    }
    ForgetOldest();
  }
  for (const Candidate& earlier : candidates_) {
    candidate.agreement.push_back(AgreementOf(candidate, earlier));
  }
  candidates_.push_back(std::move(candidate));
  Decide();
}

void PairEvidence::AddToMerge(const Candidate& candidate) {
  if (std::ranges::all_of(agreeing_, [&](int k) {
        return AgreementOf(candidate, candidates_[k]) == Agreement::kAgree;
      })) {
    std::vector<int64_t>& ids = decision_.agreeing;
    ids.insert(std::ranges::upper_bound(ids, candidate.id), candidate.id);
  }
}

void PairEvidence::ForgetOldest() {
  candidates_.erase(candidates_.begin());
  for (Candidate& candidate : candidates_) {
    candidate.agreement.erase(candidate.agreement.begin());
  }
}

void PairEvidence::Save(ByteWriter* writer) const {
  writer->PutCount(candidates_.size());
  for (const Candidate& candidate : candidates_) {
    writer->Put(candidate.id);
    writer->Put(candidate.node_a);
    writer->Put(candidate.node_b);
    Put(candidate.relative, writer);
    writer->Put(candidate.num_inliers);
    writer->Put(candidate.sufficient);
    Put(candidate.T_odom_a_odom_b, writer);
    for (const Agreement agreement : candidate.agreement) {
      writer->Put(agreement);
    }
  }
  writer->Put(agreeing_);
  writer->Put(decision_.merge);
  writer->Put(decision_.agreeing);
  writer->Put(decision_.viewpoints);
  writer->Put(decision_.rival_viewpoints);
}

bool PairEvidence::Restore(ByteReader* reader) {
  candidates_.resize(reader->GetCount(1));
  for (size_t i = 0; i < candidates_.size(); ++i) {
    Candidate& candidate = candidates_[i];
    reader->Get(&candidate.id);
    reader->Get(&candidate.node_a);
    reader->Get(&candidate.node_b);
    Get(reader, &candidate.relative);
    reader->Get(&candidate.num_inliers);
    reader->Get(&candidate.sufficient);
    Get(reader, &candidate.T_odom_a_odom_b);
    for (size_t earlier = 0; earlier < i; ++earlier) {
      Agreement agreement{};
      reader->Get(&agreement);
      if (agreement > Agreement::kAgree) {
        return false;
      }
      candidate.agreement.push_back(agreement);
    }
    if (candidate.node_a < 0 || candidate.node_a >= static_cast<int>(a_->size()) ||
        candidate.node_b < 0 || candidate.node_b >= static_cast<int>(b_->size())) {
      return false;
    }
  }
  reader->Get(&agreeing_);
  reader->Get(&decision_.merge);
  reader->Get(&decision_.agreeing);
  reader->Get(&decision_.viewpoints);
  reader->Get(&decision_.rival_viewpoints);
  return reader->ok() && std::ranges::all_of(agreeing_, [this](int k) {
           return k >= 0 && k < static_cast<int>(candidates_.size());
         });
}

std::vector<int> PairEvidence::LargestAgreeing(std::vector<int> among) const {
  std::vector<int> degree(candidates_.size(), 0);
  for (const int k : among) {
    for (const int l : among) {
      degree[k] += AgreeAt(k, l) ? 1 : 0;
    }
  }
  std::ranges::sort(among, [&](int k, int l) {
    return std::pair(-degree[k], candidates_[k].id) < std::pair(-degree[l], candidates_[l].id);
  });
  std::vector<int> largest;
  for (size_t seed = 0; seed < std::min(among.size(), kMaxSeeds); ++seed) {
    std::vector<int> set = {among[seed]};
    for (const int k : among) {
      if (k != among[seed] && std::ranges::all_of(set, [&](int l) { return AgreeAt(k, l); })) {
        set.push_back(k);
      }
    }
    if (set.size() > largest.size()) {
      largest = std::move(set);
    }
  }
  return largest;
}

bool PairEvidence::DifferentViewpoint(const Candidate& k, const Candidate& l) const {
  return Elsewhere((*a_)[k.node_a], (*a_)[l.node_a]) || Elsewhere((*b_)[k.node_b], (*b_)[l.node_b]);
}

std::vector<int> PairEvidence::Viewpoints(const std::vector<int>& candidates) const {
  std::vector<int> sorted = candidates;
  std::ranges::sort(sorted, [&](int k, int l) {
    return std::pair(-candidates_[k].num_inliers, candidates_[k].id) <
           std::pair(-candidates_[l].num_inliers, candidates_[l].id);
  });
  std::vector<int> viewpoints;
  for (const int k : sorted) {
    if (std::ranges::all_of(viewpoints, [&](int l) {
          return DifferentViewpoint(candidates_[k], candidates_[l]);
        })) {
      viewpoints.push_back(k);
    }
  }
  return viewpoints;
}

double PairEvidence::SceneExtent(const std::vector<int>& candidates) const {
  double extent_a = 0, extent_b = 0;
  for (const int k : candidates) {
    for (const int l : candidates) {
      const auto apart = [](const OdometryChain& chain, int i, int j) {
        return (chain[i].scene_odom - chain[j].scene_odom).norm();
      };
      extent_a = std::max(extent_a, apart(*a_, candidates_[k].node_a, candidates_[l].node_a));
      extent_b = std::max(extent_b, apart(*b_, candidates_[k].node_b, candidates_[l].node_b));
    }
  }
  return std::min(extent_a, extent_b);
}

bool PairEvidence::Enough(const std::vector<int>& viewpoints, int rival_viewpoints) const {
  const auto strong = std::ranges::count_if(
      viewpoints, [&](int k) { return candidates_[k].num_inliers >= kStrongInliers; });
  const int count = static_cast<int>(viewpoints.size());
  if (HasSufficient()) {
    return rival_viewpoints <= kMaxRivalShare * std::max(count, kMinViewpoints + 1);
  }
  if (SceneExtent(viewpoints) < options_.min_scene_extent_m) {
    return (count > kMinViewpoints || strong > kMinStrongViewpoints) &&
           rival_viewpoints <= kMaxRivalShareAtOneSpot * count;
  }
  return (count >= kMinViewpoints || strong >= kMinStrongViewpoints) &&
         rival_viewpoints <= kMaxRivalShare * count;
}

int PairEvidence::BestMember(const std::vector<int>& agreeing) const {
  const size_t stride = 1 + agreeing.size() / kMaxCompared;
  int best = agreeing.front();
  double best_sum = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < agreeing.size(); i += stride) {
    const int l = agreeing[i];
    double sum = 0;
    for (size_t j = 0; j < agreeing.size(); j += stride) {
      const int k = agreeing[j];
      const Innovation innovation = Compare(candidates_[k], candidates_[l]);
      const Matrix4d covariance = innovation.measurement + innovation.odometry;
      // A likelihood, not the distance alone: by distance, a member with a large covariance always
      // wins.
      sum += innovation.error.dot(covariance.ldlt().solve(innovation.error)) +
             std::log(covariance.determinant());
    }
    if (sum < best_sum) {
      best = l;
      best_sum = sum;
    }
  }
  return best;
}

Pose4 PairEvidence::Alignment() const {
  constexpr int kIterations = 5;
  const Candidate& best = candidates_[BestMember(agreeing_)];
  Pose4 T = best.T_odom_a_odom_b;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Matrix4d H = Matrix4d::Zero();
    Vector4d g = Vector4d::Zero();
    for (const int k : agreeing_) {
      const Candidate& candidate = candidates_[k];
      const Innovation innovation = Compare(candidate, best);
      const Matrix4d information = (innovation.measurement + innovation.odometry).inverse();
      const Eigen::Vector3d& p_b = (*b_)[candidate.node_b].T_odom_body.t;
      Vector4d error;
      error << (*a_)[candidate.node_a].T_odom_body.t + candidate.relative.t - T * p_b,
          WrapAngle(candidate.relative.yaw - T.yaw);
      const Eigen::Vector3d arm = YawRotation(T.yaw) * p_b;
      Matrix4d J = Matrix4d::Identity();  // d(T * p_b, yaw) / d(T.p, yaw)
      J.topRightCorner<3, 1>() = Eigen::Vector3d(-arm.y(), arm.x(), 0);
      H += J.transpose() * information * J;
      g += J.transpose() * information * error;
    }
    const Vector4d step = H.ldlt().solve(g);
    T.p += step.head<3>();
    T.yaw = WrapAngle(T.yaw + step[3]);
  }
  return T;
}

bool PairEvidence::HasSufficient() const {
  return std::ranges::any_of(agreeing_, [this](int k) { return candidates_[k].sufficient; });
}

PairEvidence::AgreeingCandidate PairEvidence::AgreeingNear(int node_a) const {
  const int k = *std::ranges::min_element(
      agreeing_, {}, [&](int l) { return std::abs(candidates_[l].node_a - node_a); });
  const Candidate& near = candidates_[k];
  return {near.node_a, near.node_b, near.T_odom_a_odom_b,
          LargestSigma(near.relative.covariance.topLeftCorner<3, 3>())};
}

// Whether it contradicts more than half of the hypothesis.
bool PairEvidence::IsRival(int candidate) const {
  const auto contradicted = std::ranges::count_if(
      agreeing_, [&](int l) { return AgreementAt(candidate, l) == Agreement::kContradict; });
  return 2 * contradicted > static_cast<int64_t>(agreeing_.size());
}

void PairEvidence::Decide() {
  std::vector<int> all;
  for (size_t k = 0; k < candidates_.size(); ++k) {
    all.push_back(static_cast<int>(k));
  }
  const std::vector<int> before = std::exchange(agreeing_, LargestAgreeing(all));
  std::vector<int> supporters, rivals;
  for (const int k : all) {
    (IsRival(k) ? rivals : supporters).push_back(k);
  }
  const std::vector<int> viewpoints = Viewpoints(agreeing_);
  const bool was_merged = decision_.merge;
  decision_ = {};
  decision_.viewpoints = static_cast<int>(viewpoints.size());
  decision_.rival_viewpoints = static_cast<int>(Viewpoints(LargestAgreeing(rivals)).size());
  // Not a hypothesis that its rivals have replaced.
  const auto lost = std::ranges::count_if(before, [&](int k) { return IsRival(k); });
  const bool is_kept = was_merged && 2 * lost < static_cast<int64_t>(before.size());
  decision_.merge =
      is_kept ? decision_.rival_viewpoints < static_cast<int>(Viewpoints(supporters).size())
              : Enough(viewpoints, decision_.rival_viewpoints);
  for (const int k : agreeing_) {
    decision_.agreeing.push_back(candidates_[k].id);
  }
  std::ranges::sort(decision_.agreeing);
}

std::vector<PairEvidence::Innovation> PairEvidence::Innovations() const {
  std::vector<int> along = agreeing_;
  std::ranges::sort(along, {}, [this](int k) {
    const Candidate& candidate = candidates_[k];
    return std::tuple(candidate.node_a, candidate.node_b, candidate.id);
  });
  std::vector<Innovation> innovations;
  const size_t half = along.size() / 2, apart = along.size() - half;
  for (size_t i = 0; i < half; ++i) {
    innovations.push_back(
        Compare(candidates_[along[i]], candidates_[along[i + apart]], Drift::kAsClaimed));
  }
  return innovations;
}

}  // namespace pangea

#include "loop_verification/aligner.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "loop_verification/correspondences/epipolar_filter.h"
#include "loop_verification/correspondences/match_sets.h"

namespace pangea {
namespace {

KeyframeWindow Last(const KeyframeWindow& frames, int count) {
  const auto n = std::min(frames.size(), static_cast<size_t>(count));
  return {frames.end() - static_cast<std::ptrdiff_t>(n), frames.end()};
}

// Standard deviation in the worst direction.
double LargestSigma(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
  return std::sqrt(solver.eigenvalues().maxCoeff());
}

// One candidate on its way through the steps; each returns why it is refused, or an empty string.
class Alignment {
 public:
  Alignment(const LoopVerificationOptions& options, const KeyframeWindow& frames_m,
            const KeyframeWindow& frames_c)
      : options_(options),
        frames_m_(frames_m),
        frames_c_(frames_c),
        windows_{MakeWindow(Last(frames_m, options.window.num_keyframes), options.window),
                 MakeWindow(Last(frames_c, options.window.num_keyframes), options.window)} {
    const double floor = options.guess_tilt_floor;
    guess_tilt_sigma_ = std::sqrt(OdometryTiltVariance() + 2 * floor * floor);
  }

  std::string FirstGuess(const PlaceCandidate& candidate, uint64_t seed) {
    std::vector<PointMatch> matches = CandidateMatches(windows_, candidate);
    for (const Direction direction : kBothDirections) {
      const std::vector<PointMatch> nearest = MatchByDescriptor(
          windows_, direction, options_.first_max_hamming, options_.first_max_ratio);
      matches.insert(matches.end(), nearest.begin(), nearest.end());
    }
    matches = Distinct(matches);
    first_matches_ = matches;
    if (static_cast<int>(matches.size()) < options_.min_pnp_inliers) {
      return "too few matched points with a depth";
    }
    const std::vector<PointObservation> observations = Observations(matches);
    const auto pnp =
        SolveUprightPnp(observations, RayPairs(candidate), windows_.c.T_w_cam.back().t,
                        windows_.m.T_w_cam.back().t, guess_tilt_sigma_, seed, options_.pnp);
    if (!pnp) {
      return "PnP found no pose";
    }
    std::set<std::pair<Direction, int>> landmarks;
    for (const int i : pnp->inliers) {
      landmarks.emplace(matches[i].direction, matches[i].landmark);
    }
    pose_ = pnp->pose;
    pnp_ = *pnp;
    report_.pnp_inliers = static_cast<int>(landmarks.size());
    return report_.pnp_inliers < options_.min_pnp_inliers ? "PnP found too few inliers" : "";
  }

  std::string CheckViews() const {
    const Eigen::Vector3d axis_m = windows_.m.T_w_cam.back().q * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d axis_c =
        pose_.T_m_c.q * (windows_.c.T_w_cam.back().q * Eigen::Vector3d::UnitZ());
    const double angle = std::acos(std::clamp(axis_m.dot(axis_c), -1.0, 1.0));
    if (angle > options_.max_view_angle || pose_.T_m_c.t.norm() > options_.max_distance_m) {
      return "views do not overlap";
    }
    return "";
  }

  // Looks for the points around the guess in the two keyframes themselves, and counts what should
  // be there and is not.
  std::string CheckVisibility() {
    std::vector<PointMatch> matches;
    // The second round looks again from the refined pose.
    for (int round = 0; round < 2; ++round) {
      matches.clear();
      VisibilityCheck visibility;
      for (const Direction direction : kBothDirections) {
        const Window& observer = windows_.Observer(direction);
        const SearchResult result =
            SearchByProjection(windows_, direction, observer.newest(), pose_, options_.search);
        matches.insert(matches.end(), result.matches.begin(), result.matches.end());
        visibility.Add(observer.keyframe(observer.newest()).camera, result);
      }
      if (static_cast<int>(matches.size()) < options_.min_found) {
        return "too few points found by projection";
      }
      pose_ = RefinePose(Observations(matches), pose_.T_m_c, guess_tilt_sigma_);
      report_.comparable = visibility.comparable();
      report_.found_share = visibility.found_share();
      report_.first_supported_share = visibility.supported_share();
    }
    if (report_.comparable < options_.min_comparable) {
      return "too few points ought to be seen from both";
    }
    if (report_.found_share < options_.min_found_share ||
        report_.first_supported_share < options_.min_first_supported_share) {
      return "the surroundings contradict";
    }
    return "";
  }

  std::string Optimise() {
    matches_.clear();
    for (const Direction direction : kBothDirections) {
      const Window& observer = windows_.Observer(direction);
      for (int frame = 0; frame <= observer.newest(); ++frame) {
        const SearchResult result =
            SearchByProjection(windows_, direction, frame, pose_, options_.search);
        matches_.insert(matches_.end(), result.matches.begin(), result.matches.end());
      }
    }
    constexpr double kMaxEpipolarError_px = 4;
    constexpr int kMinEpipolarPairs = 16;
    matches_ = FilterByFundamental(windows_, Agreeing(windows_, matches_), kMaxEpipolarError_px,
                                   kMinEpipolarPairs);
    if (static_cast<int>(matches_.size()) < options_.min_inliers) {
      return "too few points found by projection";
    }
    ba_ = SolveJointBa(windows_, matches_, pose_.T_m_c, options_.ba);
    return ba_ ? "" : "the window optimisation failed";
  }

  // The same count along the way to the two keyframes, where more than the object before them is in
  // view.
  std::string CheckWiderVisibility() {
    const WindowPair wide{MakeWindow(frames_m_, options_.window),
                          MakeWindow(frames_c_, options_.window)};
    const PoseEstimate pose{ba_->T_m_c, pose_.covariance};
    VisibilityCheck visibility;
    for (const Direction direction : kBothDirections) {
      const Window& observer = wide.Observer(direction);
      for (int frame = observer.newest(); frame >= 0; frame -= options_.visibility_stride) {
        visibility.Add(observer.keyframe(frame).camera,
                       SearchByProjection(wide, direction, frame, pose, options_.search));
      }
    }
    report_.supported_share = visibility.supported_share();
    return report_.supported_share < options_.min_supported_share ? "the surroundings contradict"
                                                                  : "";
  }

  std::string CheckGravity() {
    const Eigen::Vector3d up = ba_->T_m_c.q * Eigen::Vector3d::UnitZ();
    const Eigen::Vector2d tilt(-up.y(), up.x());
    const Eigen::Matrix3d R_m_Km =
        windows_.m.keyframe(windows_.m.newest()).T_odom_body.q.toRotationMatrix();
    const Eigen::Matrix3d visual =
        R_m_Km * ba_->covariance.bottomRightCorner<3, 3>() * R_m_Km.transpose();
    const double floor = options_.gravity_floor;
    const Eigen::Matrix2d covariance =
        visual.topLeftCorner<2, 2>() +
        (OdometryTiltVariance() + 2 * floor * floor) * Eigen::Matrix2d::Identity();
    report_.tilt = tilt.norm();
    report_.tilt_chi2 = tilt.dot(covariance.ldlt().solve(tilt));
    return report_.tilt > options_.max_tilt || report_.tilt_chi2 > options_.max_tilt_chi2
               ? "roll or pitch contradicts gravity"
               : "";
  }

  std::string Accept() {
    std::set<std::pair<Direction, int>> landmarks;
    std::map<Direction, std::set<int>> cells;
    for (size_t i = 0; i < matches_.size(); ++i) {
      if (!ba_->inlier[i]) {
        continue;
      }
      const PointMatch& match = matches_[i];
      landmarks.emplace(match.direction, match.landmark);
      const Window& observer = windows_.Observer(match.direction);
      if (match.observed.frame == observer.newest()) {
        cells[match.direction].insert(
            ImageCell(observer.keyframe(observer.newest()).camera,
                      observer.corner(match.observed).pixel.cast<double>()));
      }
    }
    for (const auto& [direction, occupied] : cells) {
      report_.cells = std::max(report_.cells, static_cast<int>(occupied.size()));
    }
    report_.landmarks = static_cast<int>(landmarks.size());
    if (report_.landmarks < options_.min_inliers) {
      return "too few inliers";
    }
    if (InlierRatio() < options_.min_inlier_ratio) {
      return "too many outliers";
    }
    if (report_.cells < options_.min_occupied_cells) {
      return "inliers too close together";
    }
    if (LargestSigma(ba_->covariance.topLeftCorner<3, 3>()) > options_.max_sigma_m ||
        LargestSigma(ba_->covariance.bottomRightCorner<3, 3>()) > options_.max_sigma_rad) {
      return "too uncertain";
    }
    if (SaysMostAlone()) {
      return "hangs on one landmark";
    }
    return HangsOnVagueMatches() ? "hangs on vague matches" : "";
  }

  // The left and the right half of what both see, each solved alone. A rotation of the view and a
  // step to the side look alike over a narrow field; matches that are a little off then give a pose
  // far off, which gravity does not contradict and the residuals do not show. But it differs from
  // half to half. What both halves take from the odometries counts twice: the test lets pass too
  // much rather than too little.
  std::string CheckHalves() {
    std::vector<PointMatch> inliers;
    for (size_t i = 0; i < matches_.size(); ++i) {
      if (ba_->inlier[i]) {
        inliers.push_back(matches_[i]);
      }
    }
    const auto halves = HalvesOfView(windows_, inliers, ba_->T_m_c);
    const auto left = SolveJointBa(windows_, halves[0], ba_->T_m_c, options_.ba);
    const auto right = SolveJointBa(windows_, halves[1], ba_->T_m_c, options_.ba);
    if (!left || !right) {
      return "half of the view gives no pose";
    }
    const Vector6d difference = left->T_Km_Kc.Minus(right->T_Km_Kc);
    const Matrix6d covariance = left->covariance + right->covariance;
    report_.halves_chi2 = difference.dot(covariance.ldlt().solve(difference));
    return report_.halves_chi2 > options_.max_halves_chi2 ? "the halves of the view disagree" : "";
  }

  // T_odom_m_odom_c of the present guess.
  Rigid3 OdomAlignment() const {
    const Rigid3 T_odom_m(Eigen::Quaterniond::Identity(),
                          windows_.m.keyframe(windows_.m.newest()).T_odom_body.t);
    const Rigid3 T_odom_c(Eigen::Quaterniond::Identity(),
                          windows_.c.keyframe(windows_.c.newest()).T_odom_body.t);
    return T_odom_m * (ba_ ? ba_->T_m_c : pose_.T_m_c) * T_odom_c.Inverse();
  }

  LoopVerificationReport Report() const {
    LoopVerificationReport report = report_;
    std::vector<bool> inlier(first_matches_.size(), false);
    for (const int i : pnp_ ? pnp_->inliers : std::vector<int>()) {
      inlier[i] = true;
    }
    const Rigid3 guess = pnp_ ? pnp_->pose.T_m_c : Rigid3();
    report.first = Shown(windows_, first_matches_, inlier, guess, guess);
    if (ba_) {
      report.found = Shown(windows_, matches_, ba_->inlier, guess, ba_->T_m_c);
    }
    return report;
  }

  void FillIn(Constraint* constraint) const {
    if (!ba_) {
      return;
    }
    constraint->T_from_to = ba_->T_Km_Kc;
    constraint->covariance = ba_->covariance;
    constraint->num_inliers = ba_->num_inlier_observations;
    constraint->inlier_ratio = InlierRatio();
    constraint->rms_px = ba_->rms_px;
  }

 private:
  // Of roll or pitch between the two odometries.
  double OdometryTiltVariance() const {
    double variance = 0;
    for (const Window* window : {&windows_.m, &windows_.c}) {
      variance += window->keyframe(window->newest()).roll_pitch_covariance.trace() / 2;
    }
    return variance;
  }

  // Where the rest of the view leaves a direction open, one near point decides it, right or wrong:
  // it was looked for where the guess had it, and whatever was found there fits. So of what is
  // known in the worst direction no landmark may say more than all others together.
  bool SaysMostAlone() {
    const double sigma_m = LargestSigma(ba_->covariance.topLeftCorner<3, 3>());
    const double without_m = LargestSigma(ba_->covariance_without_one.topLeftCorner<3, 3>());
    report_.sigma_without_one_m = without_m;
    return without_m * without_m > 2 * sigma_m * sigma_m;
  }

  // One wrong match can be found out; two or three together, all near, agree. They are looked for
  // where the guess has them, so they fit, but they look alike only vaguely: what is surely the
  // same must keep the promise without them.
  bool HangsOnVagueMatches() {
    constexpr double kNotFixed_m = 1e3;
    report_.sigma_of_sure_m = ba_->covariance_of_sure
                                  ? LargestSigma(ba_->covariance_of_sure->topLeftCorner<3, 3>())
                                  : kNotFixed_m;
    return report_.sigma_of_sure_m > options_.max_sigma_m;
  }

  double InlierRatio() const {
    return static_cast<double>(ba_->num_inlier_observations) / static_cast<double>(matches_.size());
  }

  std::vector<RayPair> RayPairs(const PlaceCandidate& candidate) const {
    std::vector<RayPair> pairs;
    const KeyframeView& m = *windows_.m.frames.back();
    const KeyframeView& c = *windows_.c.frames.back();
    for (const auto& [corner_c, corner_m] : candidate.corner_matches) {
      if (!c.has_ray(corner_c) || !m.has_ray(corner_m)) {
        continue;
      }
      const double sigma_c =
          CornerSigma(c.keyframe().corners[corner_c], options_.search.pixel_sigma) *
          c.keyframe().camera.PixelAngle();
      const double sigma_m =
          CornerSigma(m.keyframe().corners[corner_m], options_.search.pixel_sigma) *
          m.keyframe().camera.PixelAngle();
      const double sigma =
          std::sqrt(sigma_c * sigma_c + sigma_m * sigma_m + guess_tilt_sigma_ * guess_tilt_sigma_);
      const auto unit = [](const Rigid3& T_w_cam, const Eigen::Vector2d& ray) {
        return Eigen::Vector3d(T_w_cam.q * Eigen::Vector3d(ray.x(), ray.y(), 1.0).normalized());
      };
      pairs.push_back({unit(windows_.m.T_w_cam.back(), m.ray(corner_m)),
                       unit(windows_.c.T_w_cam.back(), c.ray(corner_c)), sigma});
    }
    return pairs;
  }

  std::vector<PointObservation> Observations(const std::vector<PointMatch>& matches) const {
    std::vector<PointObservation> observations;
    observations.reserve(matches.size());
    for (const PointMatch& match : matches) {
      observations.push_back(MakeObservation(windows_, match, options_.search.pixel_sigma));
    }
    return observations;
  }

  const LoopVerificationOptions& options_;
  const KeyframeWindow& frames_m_;
  const KeyframeWindow& frames_c_;
  WindowPair windows_;
  double guess_tilt_sigma_ = 0;  // radians, of roll and pitch between the windows
  PoseEstimate pose_;
  LoopVerificationReport report_;
  std::vector<PointMatch> first_matches_;
  std::optional<UprightPnpResult> pnp_;
  std::vector<PointMatch> matches_;
  std::optional<JointBaResult> ba_;
};

}  // namespace

Constraint Aligner::Align(const KeyframeWindow& frames_m, const KeyframeWindow& frames_c,
                          const PlaceCandidate& candidate, const LoopVerificationGate& gate,
                          LoopVerificationReport* report) const {
  Constraint constraint;
  constraint.from = candidate.match;
  constraint.to = frames_c.back()->keyframe().id;
  constraint.kind = candidate.kind;

  Alignment alignment(options_, frames_m, frames_c);
  const uint64_t seed = StableHash(constraint.from, constraint.to, 1);
  constraint.reason = alignment.FirstGuess(candidate, seed);
  const auto step = [&constraint](auto&& check) {
    if (constraint.reason.empty()) {
      constraint.reason = check();
    }
  };
  step([&] { return alignment.CheckViews(); });
  step([&] { return gate(alignment.OdomAlignment()); });
  step([&] { return alignment.CheckVisibility(); });
  step([&] { return alignment.Optimise(); });
  alignment.FillIn(&constraint);
  step([&] { return alignment.CheckGravity(); });
  step([&] { return alignment.CheckViews(); });
  step([&] { return gate(alignment.OdomAlignment()); });
  step([&] { return alignment.Accept(); });
  step([&] { return alignment.CheckWiderVisibility(); });
  step([&] { return alignment.CheckHalves(); });
  constraint.accepted = constraint.reason.empty();
  if (report != nullptr) {
    *report = alignment.Report();
  }
  return constraint;
}

}  // namespace pangea

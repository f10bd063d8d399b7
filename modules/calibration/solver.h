#pragma once

// Robust least squares over all pairs: Cauchy loss, Levenberg-Marquardt, each pair's translation
// eliminated (Kaufman, 1975), numeric derivatives with respect to the parameters.
//
// Covariance: residuals of one image share the errors of its stamp and of the gyroscope, so they
// are not independent. The covariance is that of generalised estimating equations, with residuals
// grouped into blocks of time, short and long ones (Liang & Zeger, Biometrika 1986), or the usual
// one if that is larger.

#include <span>
#include <vector>

#include "calibration/epipolar.h"
#include "core/imu/imu.h"

namespace pangea::calibration {

constexpr double kConverged = 0.1, kRoughlyConverged = 1;
constexpr double kBlock_s = 1.0;  // block of residuals that may share an error

struct Solution {
  Parameters parameters;
  Information covariance = Information::Identity();
  double sigma_px = 0;      // of residuals, robust
  double inlier_share = 0;  // share of residuals within three standard deviations
  double cost = 0;          // robust cost of all residuals, in units of 1 px
  int iterations = 0;
};

class Solver {
 public:
  // `velocity_change`: within a pair, see epipolar.h.
  Solver(std::span<const FramePair> pairs, std::span<const ImuSample> imu, int64_t origin_utime,
         double velocity_change);

  // Iterates until the step is below `within` standard deviations (for independent residuals, so
  // smaller than those of the covariance). Rows with a prior sigma of 0 are fixed.
  Solution Solve(const Parameters& start, const Prior& prior, double within = kConverged) const;
  // Robust cost per pair, and of all pairs, without prior; to compare hypotheses.
  std::vector<double> Costs(const Parameters& parameters, double sigma_px) const;
  double Cost(const Parameters& parameters, double sigma_px) const;

 private:
  struct Linearised;
  struct PairResiduals;
  struct PairTerms;
  struct Reduced;
  using Own = Eigen::Matrix<double, 8, 1>;
  struct State {
    Parameters parameters;
    std::vector<Translation> translations;  // per pair
    double cost = 0;
  };
  State Begin(const Parameters& parameters) const;
  // Each translation is either updated by the step or computed anew, whichever costs less.
  State Moved(const State& state, const Linearised& at, const Prior& prior, const Tangent& step,
              double damping) const;
  Linearised Linearise(const State& state, const Prior& prior) const;
  // d(residuals)/d(parameters) of each pair, for fixed translations.
  std::vector<Eigen::MatrixXd> Jacobians(const Parameters& parameters, const Prior& prior,
                                         const std::vector<PairRays>& rays,
                                         const std::vector<PairResiduals>& terms) const;
  PairTerms TermsOf(const PairGeometry& geometry, const PairResiduals& at,
                    const Eigen::MatrixXd& jacobian, double sigma_px) const;
  std::vector<PairRays> Rays(const CameraModel& camera) const;
  std::vector<PairGeometry> Geometries(const Parameters& parameters,
                                       const std::vector<PairRays>& rays) const;
  double RobustCost(const Eigen::VectorXd& residuals, double sigma_px) const;
  double CostOf(const PairGeometry& geometry, const Translation& translation,
                double sigma_px) const;
  double PriorCost(const Parameters& parameters, const Prior& prior) const;
  bool Plausible(const CameraModel& camera) const;
  Information Scatter(const Reduced& reduced, double block_s) const;
  Information Covariance(const Linearised& at) const;

  std::span<const FramePair> pairs_;
  std::span<const ImuSample> imu_;
  int64_t origin_utime_;
  double velocity_change_;
};

}  // namespace pangea::calibration

#pragma once

// Tests whether the NEES (normalised estimation error squared) over independent rides fits an
// honest covariance. Keyframes of one ride share most of their error, so each ride counts once:
// with one keyframe (chi-squared test), or with its mean (Student's t test on the rides' means).
//
// An honest estimator fails one expectation with a probability of kFalseAlarm. The window is known
// to be a little over-confident: it linearises about estimates and keeps what it marginalised. So
// a covariance may be too small by up to kOverconfidence, but not too large.

#include <Eigen/Core>
#include <string>
#include <vector>

namespace pangea::vio {

constexpr double kFalseAlarm = 0.001;
constexpr double kOverconfidence = 1.4;  // of variances; measured: 0.8 to 1.5 (test output)

// For one keyframe per ride.
class NeesOfRides {
 public:
  void Add(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance);
  void ExpectHonest(const std::string& what) const;

 private:
  double sum_ = 0;
  double degrees_ = 0;
};

// For all keyframes of each ride: the means of NEES / dimension per ride.
void ExpectHonest(const std::string& what, const std::vector<double>& ride_means);

}  // namespace pangea::vio

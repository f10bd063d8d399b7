#pragma once

// Whether a NEES (normalised estimation error squared) over independent rides is what an honest
// covariance gives. Keyframes of one ride share most of their error, so each ride counts once: by
// one keyframe (chi-squared), or by its mean (Student's t from the spread of the rides' means).
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

// Of one keyframe a ride.
class NeesOfRides {
 public:
  void Add(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance);
  void ExpectHonest(const std::string& what) const;

 private:
  double sum_ = 0;
  double degrees_ = 0;
};

// Of all keyframes of each ride: the rides' means, by their dimension.
void ExpectHonest(const std::string& what, const std::vector<double>& ride_means);

}  // namespace pangea::vio

#include "vio/window/testing/test_nees.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <iostream>

namespace pangea::vio {

void NeesOfRides::Add(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  sum_ += error.dot(covariance.llt().solve(error));
  degrees_ += static_cast<double>(error.size());
}

void NeesOfRides::ExpectHonest(const std::string& what) const {
  ASSERT_GT(degrees_, 0) << what;
  const boost::math::chi_squared honest(degrees_);
  const double least = boost::math::quantile(honest, kFalseAlarm / 2) / degrees_;
  const double most =
      kOverconfidence * boost::math::quantile(honest, 1 - kFalseAlarm / 2) / degrees_;
  const double nees = sum_ / degrees_;
  std::cout << "NEES of " << what << ": " << nees << " in [" << least << ", " << most << "]\n";
  EXPECT_GT(nees, least) << what << ": the covariance is too large";
  EXPECT_LT(nees, most) << what << ": the covariance is too small";
}

void ExpectHonest(const std::string& what, const std::vector<double>& ride_means) {
  ASSERT_GE(ride_means.size(), 5u) << what;
  const Eigen::Map<const Eigen::ArrayXd> means(ride_means.data(),
                                               static_cast<Eigen::Index>(ride_means.size()));
  const double n = static_cast<double>(ride_means.size());
  const double nees = means.mean();
  const double spread = std::sqrt((means - nees).square().sum() / (n - 1));
  const double within = boost::math::quantile(boost::math::students_t(n - 1), 1 - kFalseAlarm / 2) *
                        spread / std::sqrt(n);
  std::cout << "NEES of " << what << ": " << nees << " +- " << within << " of rides\n";
  EXPECT_GT(nees + within, 1) << what << ": the covariance is too large";
  EXPECT_LT(nees - within, kOverconfidence) << what << ": the covariance is too small";
}

}  // namespace pangea::vio

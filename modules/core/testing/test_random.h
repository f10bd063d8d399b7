#pragma once

#include <Eigen/Core>
#include <random>

#include "core/rigid3.h"

namespace pangea {

inline double Uniform(std::mt19937_64& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

inline Eigen::Vector3d RandomVector(std::mt19937_64& rng, double sigma) {
  std::normal_distribution<double> normal(0, sigma);
  const double x = normal(rng), y = normal(rng), z = normal(rng);
  return {x, y, z};
}

inline Rigid3 RandomPose(std::mt19937_64& rng, double sigma_rad, double sigma_m) {
  const Eigen::Vector3d rotation = RandomVector(rng, sigma_rad);
  return {ExpSo3(rotation), RandomVector(rng, sigma_m)};
}

}  // namespace pangea

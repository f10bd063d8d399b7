#pragma once

#include <Eigen/Core>
#include <random>

namespace pangea::vio {

inline Eigen::Vector3d RandomVector(std::mt19937_64& rng, double sigma) {
  std::normal_distribution<double> normal(0, sigma);
  const double x = normal(rng), y = normal(rng), z = normal(rng);
  return {x, y, z};
}

}  // namespace pangea::vio

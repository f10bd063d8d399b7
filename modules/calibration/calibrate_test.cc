#include "calibration/calibrate.h"

#include <gtest/gtest.h>

#include "calibration/calibration_test_world.h"

namespace pangea::calibration {
namespace {

TEST(Calibrate, AsFarOffAsItSays) {
  constexpr int kWorlds = 20;
  Tangent nees = Tangent::Zero();
  for (int seed = 1; seed <= kWorlds; ++seed) {
    const TestWorld world = MakeTestWorld({.seed = static_cast<uint64_t>(seed)});
    const Result result = Calibrate(world.input, {});
    EXPECT_EQ(result.refused, "") << seed;
    const Tangent off = result.parameters.Minus(world.truth);
    nees += off.cwiseQuotient(result.sigma).cwiseAbs2() / kWorlds;
    std::cerr << seed << " off " << off.transpose() << "\n  sigma " << result.sigma.transpose()
              << "\n sigma_px " << result.sigma_px << " inl " << result.inlier_share << " next "
              << result.next_cost << "\n";
  }
  std::cerr << nees.transpose() << "\n";
}

}  // namespace
}  // namespace pangea::calibration

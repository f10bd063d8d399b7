#include "vio/window/stamp_jitter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace pangea::vio {
namespace {

double FoundJitter(double jitter_s, double late_s, int frames) {
  std::mt19937_64 rng(3);
  std::normal_distribution<double> normal(0, jitter_s);
  StampJitter jitter;
  double t = 100;
  for (int i = 0; i < frames; ++i) {
    t += i % 60 < 30 ? 0.040 : 0.050;  // the exposure changes
    t += i % 35 == 34 ? 0.040 : 0;     // an image is missing
    const double late = i % 40 == 20 ? late_s : 0;
    jitter.AddFrame(std::llround(1e6 * (t + normal(rng) + late)));
  }
  return jitter.sigma_s();
}

TEST(StampJitter, IsFoundBesideLateStampsAndChangesOfTheRate) {
  for (const double sigma_s : {0.002, 0.005}) {
    EXPECT_NEAR(FoundJitter(sigma_s, 0.02, 60), sigma_s, 0.4 * sigma_s);
  }
}

TEST(StampJitter, OfExactStampsIsNone) {
  EXPECT_EQ(FoundJitter(0, 0, 60), 0);
  EXPECT_EQ(FoundJitter(5e-5, 0.02, 60), 0);  // rounding errors, and a few late stamps
}

TEST(StampJitter, IsNotGuessedFromAFewStamps) { EXPECT_EQ(FoundJitter(0.005, 0, 7), 0); }

}  // namespace
}  // namespace pangea::vio

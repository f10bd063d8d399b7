#include "core/numerics/elementary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace pangea {
namespace {

constexpr double kPi = std::numbers::pi;

class Elementary : public testing::Test {
 protected:
  double Draw(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }
  std::mt19937_64 random_{1};
};

// The difference in units in the last place.
double Off(double found, double exact) {
  const double size = std::abs(exact);
  return std::abs(found - exact) / (std::nextafter(size, 2 * size + 1) - size);
}

TEST_F(Elementary, AreAsNearAsTheCLibrarys) {
  for (int i = 0; i < 200'000; ++i) {
    const double angle = Draw(-7, 7), x = Draw(-5, 5) * std::exp(Draw(-9, 9)), y = Draw(-5, 5);
    const SinCos of = SinCosOf(angle);
    EXPECT_LE(Off(of.sin, std::sin(angle)), 2) << angle;
    EXPECT_LE(Off(of.cos, std::cos(angle)), 2) << angle;
    EXPECT_LE(Off(Tan(0.22 * angle), std::tan(0.22 * angle)), 4) << angle;
    EXPECT_LE(Off(Atan(x), std::atan(x)), 3) << x;
    EXPECT_LE(Off(Atan2(y, x), std::atan2(y, x)), 4) << y << " " << x;
  }
}

TEST_F(Elementary, OfManyTurns) {
  for (const double angle : {1e3, -1e4, 99'999.0, -1e6}) {
    EXPECT_NEAR(SinCosOf(angle).sin, std::sin(angle), 1e-9);
    EXPECT_NEAR(SinCosOf(angle).cos, std::cos(angle), 1e-9);
  }
}

TEST_F(Elementary, OnTheAxes) {
  EXPECT_EQ(SinCosOf(0).sin, 0);
  EXPECT_EQ(SinCosOf(0).cos, 1);
  EXPECT_EQ(Atan(0), 0);
  EXPECT_EQ(Atan2(0, 1), 0);
  EXPECT_EQ(Atan2(1, 0), kPi / 2);
  EXPECT_EQ(Atan2(-1, 0), -kPi / 2);
  EXPECT_EQ(Atan2(0, -1), kPi);
  EXPECT_EQ(Atan2(-0.0, -1), -kPi);
  EXPECT_EQ(Atan2(0, 0), 0);
}

TEST_F(Elementary, OfWhatIsNoNumberIsNone) {
  for (const double angle : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_TRUE(std::isnan(SinCosOf(angle).sin));
    EXPECT_TRUE(std::isnan(Tan(angle)));
  }
  EXPECT_TRUE(std::isnan(Atan(std::nan(""))));
}

}  // namespace
}  // namespace pangea

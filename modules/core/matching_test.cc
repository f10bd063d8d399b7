#include "core/matching.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

#include "core/testing/test_descriptors.h"

namespace pangea {
namespace {

using Rng = std::mt19937_64;

Descriptor FlipBits(Descriptor descriptor, int first, int count) {
  for (int bit = first; bit < first + count; ++bit) {
    FlipBit(&descriptor, bit);
  }
  return descriptor;
}

Corner MakeCorner(float u, float v, const Descriptor& descriptor) {
  Corner corner;
  corner.pixel = {u, v};
  corner.descriptor = descriptor;
  return corner;
}

std::vector<Corner> RandomCorners(int count, Rng& rng) {
  std::uniform_real_distribution<float> u(0, 751);
  std::uniform_real_distribution<float> v(0, 479);
  std::vector<Corner> corners;
  for (int i = 0; i < count; ++i) {
    const float pixel_u = u(rng);
    corners.push_back(MakeCorner(pixel_u, v(rng), RandomDescriptor(rng)));
  }
  return corners;
}

TEST(MatchCorners, FindsEveryCornerOfAShuffledNoisyCopy) {
  Rng rng(1);
  const std::vector<Corner> a = RandomCorners(400, rng);
  std::vector<Corner> b;
  for (int i = 399; i >= 0; --i) {
    b.push_back(a[i]);
    b.back().descriptor = FlipBits(a[i].descriptor, i % 200, 40);
  }
  const std::vector<CornerMatch> matches = MatchCorners(a, b, {});
  ASSERT_EQ(matches.size(), 400u);
  for (const CornerMatch& match : matches) {
    EXPECT_EQ(match.b, 399 - match.a);
    EXPECT_EQ(match.distance, 40);
  }
}

TEST(MatchCorners, UnrelatedCornersStayUnmatched) {
  Rng rng(2);
  const auto a = RandomCorners(500, rng);
  EXPECT_LE(MatchCorners(a, RandomCorners(500, rng), {}).size(), 0u);
}

TEST(MatchCorners, RatioTestRefusesATwinElsewhereButNotTheSameCornerOnAnotherOctave) {
  Rng rng(3);
  const Descriptor descriptor = RandomDescriptor(rng);
  const std::vector<Corner> a = {MakeCorner(100, 100, descriptor)};
  const Corner best = MakeCorner(300, 200, FlipBits(descriptor, 0, 20));
  const Corner same_place = MakeCorner(302, 201, FlipBits(descriptor, 50, 22));
  const Corner elsewhere = MakeCorner(400, 50, FlipBits(descriptor, 50, 22));
  EXPECT_EQ(MatchCorners(a, {best, same_place}, {}).size(), 1u);
  EXPECT_TRUE(MatchCorners(a, {best, elsewhere}, {}).empty());
}

TEST(PairsWithin, AreAllPairsUpToTheDistance) {
  Rng rng(3);
  const std::vector<Corner> a = RandomCorners(23, rng);
  const std::vector<Corner> b = RandomCorners(41, rng);
  constexpr int kDistance = kDescriptorBits / 2;  // of random ones about half are nearer
  std::vector<std::array<int, 3>> expected, found;
  for (int i = 0; i < static_cast<int>(a.size()); ++i) {
    for (int j = 0; j < static_cast<int>(b.size()); ++j) {
      if (const int d = HammingDistance(a[i].descriptor, b[j].descriptor); d <= kDistance) {
        expected.push_back({i, j, d});
      }
    }
  }
  for (const CornerMatch& pair : PairsWithin(a, b, kDistance)) {
    found.push_back({pair.a, pair.b, pair.distance});
  }
  EXPECT_EQ(found, expected);
  EXPECT_GT(found.size(), 100u);
}

TEST(MatchCorners, OnlyTheMutualNearestOfTwoRivalsStays) {
  Rng rng(4);
  const Descriptor descriptor = RandomDescriptor(rng);
  const std::vector<Corner> a = {MakeCorner(10, 10, FlipBits(descriptor, 0, 12)),
                                 MakeCorner(90, 90, FlipBits(descriptor, 100, 10))};
  const std::vector<CornerMatch> matches = MatchCorners(a, {MakeCorner(50, 50, descriptor)}, {});
  ASSERT_EQ(matches.size(), 1u);
  EXPECT_EQ(matches[0].a, 1);
}

TEST(MatchCorners, EmptyListsGiveNothing) {
  Rng rng(5);
  EXPECT_TRUE(MatchCorners({}, RandomCorners(5, rng), {}).empty());
  EXPECT_TRUE(MatchCorners(RandomCorners(5, rng), {}, {}).empty());
}

TEST(CornerGrid, WithinAgreesWithExhaustiveSearch) {
  Rng rng(6);
  const std::vector<Corner> corners = RandomCorners(700, rng);
  const CornerGrid grid(corners);
  std::uniform_real_distribution<double> uniform(-60, 800);
  for (int trial = 0; trial < 200; ++trial) {
    const double u = uniform(rng);
    const Eigen::Vector2d pixel(u, uniform(rng));
    std::vector<int> expected;
    for (int i = 0; i < 700; ++i) {
      if ((corners[i].pixel.cast<double>() - pixel).norm() <= 45) {
        expected.push_back(i);
      }
    }
    EXPECT_EQ(grid.Within(pixel, 45), expected);
  }
}

TEST(CornerGrid, NearestDescriptorInsideTheRadiusWins) {
  Rng rng(7);
  const Descriptor descriptor = RandomDescriptor(rng);
  const std::vector<Corner> corners = {MakeCorner(100, 100, FlipBits(descriptor, 0, 30)),
                                       MakeCorner(104, 100, RandomDescriptor(rng)),
                                       MakeCorner(200, 100, descriptor)};
  const CornerGrid grid(corners);
  const auto match = grid.Nearest({101, 102}, 10, descriptor, {});
  ASSERT_TRUE(match.has_value());
  EXPECT_EQ(match->b, 0);
  EXPECT_EQ(match->distance, 30);
  EXPECT_FALSE(grid.Nearest({300, 300}, 10, descriptor, {}).has_value());
  MatchingOptions strict;
  strict.max_distance = 29;
  EXPECT_FALSE(grid.Nearest({101, 102}, 10, descriptor, strict).has_value());
}

TEST(CornerGrid, AnEmptyKeyframeIsFine) {
  const std::vector<Corner> none;
  EXPECT_TRUE(CornerGrid(none).Within({10, 10}, 1000).empty());
}

}  // namespace
}  // namespace pangea

#include "core/numerics/triangulation.h"

#include <gtest/gtest.h>

#include <vector>

namespace pangea {
namespace {

using Eigen::Vector3d;

std::vector<LineOfSight> Towards(const Vector3d& point, const std::vector<Vector3d>& origins) {
  std::vector<LineOfSight> lines;
  for (const Vector3d& origin : origins) {
    lines.push_back({origin, (point - origin).normalized()});
  }
  return lines;
}

TEST(TriangulateMidpoint, FindsThePointThatAllSee) {
  const Vector3d point(1, -2, 5);
  const auto found = TriangulateMidpoint(Towards(point, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0.5}}));
  ASSERT_TRUE(found);
  EXPECT_LT((*found - point).norm(), 1e-12);
}

TEST(TriangulateMidpoint, OfTwoSkewLinesIsTheMiddle) {
  const std::vector<LineOfSight> lines = {{{0, 0, 1}, Vector3d::UnitX()},
                                          {{3, 0, 2}, Vector3d::UnitY()}};
  const auto found = TriangulateMidpoint(lines);
  ASSERT_TRUE(found);
  EXPECT_LT((*found - Vector3d(3, 0, 1.5)).norm(), 1e-12);
}

TEST(TriangulateMidpoint, ParallelLinesHaveNone) {
  const std::vector<LineOfSight> lines = {{{0, 0, 0}, Vector3d::UnitZ()},
                                          {{1, 0, 0}, Vector3d::UnitZ()}};
  EXPECT_FALSE(TriangulateMidpoint(lines));
  EXPECT_FALSE(TriangulateMidpoint(Towards({0, 0, 5}, {{0, 0, 0}}))) << "one alone";
}

}  // namespace
}  // namespace pangea

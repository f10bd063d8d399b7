#include "thinning/view_coverage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace pangea {
namespace {

constexpr double kDepth_m = 5;

// A walk along x with a view per metre; the views look along y.
MapViews Walk(double from_m, int count, int group = 0) {
  MapViews map;
  map.group = group;
  for (int i = 0; i < count; ++i) {
    map.views.push_back(
        {{Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY()),
          {from_m + i, 0, 0}},
         kDepth_m,
         false});
  }
  return map;
}

MapViews Staying(MapViews map) {
  for (View& view : map.views) {
    view.must_stay = true;
  }
  return map;
}

bool Always(const ViewRef&, const ViewRef&) { return true; }
bool Never(const ViewRef&, const ViewRef&) { return false; }

int64_t NumKept(const std::vector<bool>& kept) { return std::ranges::count(kept, true); }

TEST(ViewCoverage, KeepsTheNewestMapsOfOneAppearance) {
  const auto kept = ChooseViews(std::vector<MapViews>(5, Walk(0, 30)), Always, {});
  EXPECT_EQ(NumKept(kept[0]), 30);
  EXPECT_EQ(NumKept(kept[1]), 30);
  for (const int older : {2, 3, 4}) {
    EXPECT_EQ(NumKept(kept[older]), 0);
  }
}

TEST(ViewCoverage, AnAppearanceFadesOnceEnoughOthersCame) {
  const auto kept = ChooseViews(std::vector<MapViews>(6, Walk(0, 30)), Never, {});
  for (const int newer : {0, 1, 2, 3}) {
    EXPECT_EQ(NumKept(kept[newer]), 30);
  }
  EXPECT_EQ(NumKept(kept[4]), 0);
  EXPECT_EQ(NumKept(kept[5]), 0);
}

TEST(ViewCoverage, WhatWasNeverRecognisedHasNoAppearanceOfItsOwn) {
  std::vector<MapViews> maps(3, Walk(0, 30));
  EXPECT_EQ(NumKept(ChooseViews(maps, Never, {})[2]), 30);
  for (View& view : maps[2].views) {
    view.recognised = false;
  }
  EXPECT_EQ(NumKept(ChooseViews(maps, Never, {})[2]), 0);
}

TEST(ViewCoverage, WhatNoNewerMapShowsStays) {
  std::vector<MapViews> maps(3, Walk(0, 30));
  maps.push_back(Walk(15, 30));  // half of this walk is beyond the others
  maps.push_back(Walk(0, 30, 1));
  const auto kept = ChooseViews(maps, Always, {});
  EXPECT_EQ(NumKept(kept[2]), 0);
  EXPECT_TRUE(kept[3][0]);   // needed to lead over the gap
  EXPECT_FALSE(kept[3][5]);  // at 20 m
  for (int i = 16; i < 30; ++i) {
    EXPECT_TRUE(kept[3][i]) << i;
  }
  EXPECT_EQ(NumKept(kept[4]), 30) << "of another group";
}

TEST(ViewCoverage, ViewsThatLookElsewhereAreOthers) {
  std::vector<MapViews> maps(3, Walk(0, 30));
  for (View& view : maps[2].views) {
    view.T_map_cam.q = YawRotation(0.4) * view.T_map_cam.q;
  }
  EXPECT_EQ(NumKept(ChooseViews(maps, Always, {})[2]), 30);
}

TEST(ViewCoverage, StaysInRows) {
  std::vector<MapViews> maps(3, Walk(0, 40));
  maps[2].views[20].must_stay = true;
  maps[2].views[28].must_stay = true;  // a gap between these two would be shorter than a row
  const auto kept = ChooseViews(maps, Always, {});
  std::vector<bool> expected(40, false);
  std::fill(expected.begin() + 16, expected.begin() + 29, true);
  expected[0] = true;
  EXPECT_EQ(kept[2], expected);
}

// Visitors start and end anywhere, and each time walk and look a little differently.
TEST(ViewCoverage, WhatStaysOfOneHallDoesNotGrowWithVisits) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> start_m(0, 20);
  std::normal_distribution<double> aside_m(0, 0.5), yaw(0, 0.2);
  std::vector<MapViews> maps;
  std::vector<int64_t> stays;
  for (int visit = 0; visit < 60; ++visit) {
    MapViews walk = Walk(start_m(random), 20);
    for (View& view : walk.views) {
      view.T_map_cam.t.y() += aside_m(random);
      view.T_map_cam.q = YawRotation(yaw(random)) * view.T_map_cam.q;
    }
    maps.insert(maps.begin(), std::move(walk));
    const auto kept = ChooseViews(maps, Always, {});
    stays.push_back(0);
    for (size_t m = 0; m < maps.size(); ++m) {
      std::vector<View> left;
      for (size_t i = 0; i < kept[m].size(); ++i) {
        if (kept[m][i]) {
          left.push_back(maps[m].views[i]);
        }
      }
      maps[m].views = std::move(left);
      stays.back() += std::ssize(maps[m].views);
    }
    std::erase_if(maps, [](const MapViews& map) { return map.views.empty(); });
  }
  const auto sum = [&stays](int from, int to) {
    return std::accumulate(stays.begin() + from, stays.begin() + to, 0.0);
  };
  EXPECT_LT(sum(40, 60), 1.2 * sum(20, 40));
}

TEST(ViewCoverage, LeavesNoGapThatProcessesWouldNotBelieve) {
  std::vector<MapViews> maps(2, Staying(Walk(0, 2000)));
  maps.push_back(Walk(0, 2000));
  maps[2].views.back().must_stay = true;
  const auto kept = ChooseViews(maps, Always, {});
  int gap = 0, longest = 0;
  for (const bool one : kept[2]) {
    gap = one ? 0 : gap + 1;
    longest = std::max(longest, gap);
  }
  EXPECT_GT(longest, 400);
  EXPECT_LE(longest, 500);
}

}  // namespace
}  // namespace pangea

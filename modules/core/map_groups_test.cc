#include "core/map_groups.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

const MapId kA{1, 1}, kB{2, 1}, kC{3, 1}, kD{4, 1};

TEST(MapGroups, AMapAloneIsNotFused) {
  MapGroups groups;
  EXPECT_FALSE(groups.IsFused(kA));
  groups.Set(kA, 1, {kA});
  EXPECT_FALSE(groups.IsFused(kA));
  EXPECT_FALSE(groups.AreFused(kA, kA));
}

TEST(MapGroups, MapsOfTwoGroupsAreNotOne) {
  MapGroups groups;
  groups.Set(kA, 1, {kA, kB});
  groups.Set(kC, 1, {kC, kD});
  EXPECT_TRUE(groups.AreFused(kA, kB));
  EXPECT_FALSE(groups.AreFused(kB, kC));
}

TEST(MapGroups, AnUndoneFusionIsNone) {
  MapGroups groups;
  groups.Set(kA, 1, {kA, kB});
  groups.Set(kA, 2, {kA});
  EXPECT_FALSE(groups.IsFused(kB));
  groups.Set(kA, 1, {kA, kB});
  EXPECT_FALSE(groups.AreFused(kA, kB)) << "an older state came late";
}

}  // namespace
}  // namespace pangea

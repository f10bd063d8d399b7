#include "place_recognition/map_groups.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

const MapId kA{1, 1}, kB{2, 1}, kC{3, 1};

TEST(MapGroups, AMapAloneIsNotFused) {
  MapGroups groups;
  EXPECT_FALSE(groups.IsFused(kA));
  groups.Set(kA, 1, {kA});
  EXPECT_FALSE(groups.IsFused(kA));
}

TEST(MapGroups, MapsOfOneGroupAreFused) {
  MapGroups groups;
  groups.Set(kA, 1, {kA, kB});
  EXPECT_TRUE(groups.IsFused(kA));
  EXPECT_TRUE(groups.IsFused(kB));
  EXPECT_FALSE(groups.IsFused(kC));
}

TEST(MapGroups, AnUndoneFusionIsNone) {
  MapGroups groups;
  groups.Set(kA, 1, {kA, kB});
  groups.Set(kA, 2, {kA});
  EXPECT_FALSE(groups.IsFused(kB));
  groups.Set(kA, 1, {kA, kB});
  EXPECT_FALSE(groups.IsFused(kB)) << "an older state came late";
}

}  // namespace
}  // namespace pangea

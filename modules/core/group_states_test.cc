#include "core/group_states.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

const MapId kA{1, 100}, kB{2, 200}, kC{3, 300};

struct Maps {
  int64_t revision = 0;
  std::vector<MapId> maps;
};

TEST(GroupStates, TheHighestRevisionOfAMapCountsInAnyOrder) {
  GroupStates<Maps> groups;
  EXPECT_EQ(groups.Find(kA), nullptr);
  const auto both = groups.Take({7, {kA, kB}});
  groups.Take({3, {kB}});
  EXPECT_EQ(groups.Find(kA), both.get());
  EXPECT_EQ(groups.Find(kB), both.get());
  const auto apart = groups.Take({8, {kB}});
  EXPECT_EQ(groups.Find(kA), both.get());
  EXPECT_EQ(groups.Find(kB), apart.get());
}

TEST(GroupStates, IsCurrentUntilOneOfItsMapsHasANewerOne) {
  GroupStates<Maps> groups;
  const auto two = groups.Take({1, {kA, kB}});
  EXPECT_TRUE(groups.IsCurrent(*two));
  const auto three = groups.Take({2, {kA, kB, kC}});
  EXPECT_TRUE(groups.IsCurrent(*three));
  EXPECT_FALSE(groups.IsCurrent(*two));
  groups.Take({3, {kC}});
  EXPECT_FALSE(groups.IsCurrent(*three));
}

TEST(GroupStates, AMapAloneIsNotFused) {
  GroupStates<Maps> groups;
  EXPECT_FALSE(groups.IsFused(kA));
  groups.Take({1, {kA}});
  EXPECT_FALSE(groups.IsFused(kA));
}

TEST(GroupStates, MapsOfOneGroupAreFused) {
  GroupStates<Maps> groups;
  groups.Take({1, {kA, kB}});
  EXPECT_TRUE(groups.IsFused(kA));
  EXPECT_TRUE(groups.IsFused(kB));
  EXPECT_FALSE(groups.IsFused(kC));
}

TEST(GroupStates, AnUndoneFusionIsNone) {
  GroupStates<Maps> groups;
  groups.Take({1, {kA, kB}});
  groups.Take({2, {kA}});
  EXPECT_FALSE(groups.IsFused(kA));
  EXPECT_FALSE(groups.IsFused(kB)) << "no state of its own is needed";
  groups.Take({1, {kA, kB}});
  EXPECT_FALSE(groups.IsFused(kB)) << "an older state came late";
}

TEST(PosedGroup, HasThePosesOfTheState) {
  MapState state;
  state.group = kA;
  state.revision = 7;
  state.maps = {kA, kB};
  state.keyframes = {{{kB, 5}, 0, Rigid3(YawRotation(0), {1, 2, 3})}};
  const PosedGroup group(state);
  EXPECT_EQ(group.id, kA);
  EXPECT_EQ(group.revision, 7);
  EXPECT_EQ(group.maps, state.maps);
  EXPECT_EQ(group.T_map_body.at({kB, 5}).t.z(), 3);
}

}  // namespace
}  // namespace pangea

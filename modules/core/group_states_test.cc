#include "core/group_states.h"

#include <gtest/gtest.h>

namespace pangea {
namespace {

const MapId kA{1, 100}, kB{2, 200}, kC{3, 300};

TEST(GroupStates, TheHighestRevisionOfAMapCountsInAnyOrder) {
  GroupStates<GroupMaps> groups;
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
  GroupStates<GroupMaps> groups;
  const auto two = groups.Take({1, {kA, kB}});
  EXPECT_TRUE(groups.IsCurrent(*two));
  const auto three = groups.Take({2, {kA, kB, kC}});
  EXPECT_TRUE(groups.IsCurrent(*three));
  EXPECT_FALSE(groups.IsCurrent(*two));
  groups.Take({3, {kC}});
  EXPECT_FALSE(groups.IsCurrent(*three));
}

TEST(GroupStates, AMapAloneIsNotFused) {
  GroupStates<GroupMaps> groups;
  EXPECT_FALSE(groups.IsFused(kA));
  groups.Take({1, {kA}});
  EXPECT_FALSE(groups.IsFused(kA));
}

TEST(GroupStates, MapsOfOneGroupAreFused) {
  GroupStates<GroupMaps> groups;
  groups.Take({1, {kA, kB}});
  EXPECT_TRUE(groups.IsFused(kA));
  EXPECT_TRUE(groups.IsFused(kB));
  EXPECT_FALSE(groups.IsFused(kC));
}

TEST(GroupStates, AnUndoneFusionIsNone) {
  GroupStates<GroupMaps> groups;
  groups.Take({1, {kA, kB}});
  groups.Take({2, {kA}});
  EXPECT_FALSE(groups.IsFused(kA));
  EXPECT_FALSE(groups.IsFused(kB)) << "no state of its own is needed";
  groups.Take({1, {kA, kB}});
  EXPECT_FALSE(groups.IsFused(kB)) << "an older state came late";
}

TEST(GroupStates, TellsWhatAStateWouldFuseAndSplit) {
  GroupStates<GroupMaps> groups;
  const auto take = [&groups](int64_t revision, const std::vector<MapId>& maps) {
    const Regrouping regrouping = groups.RegroupedBy({revision, maps});
    groups.Take({revision, maps});
    return std::pair(regrouping.fused, regrouping.split);
  };
  const std::pair kNothing(false, false), kFused(true, false), kSplit(false, true);
  EXPECT_EQ(take(1, {kA}), kNothing);
  EXPECT_EQ(take(2, {kA, kB}), kFused);
  EXPECT_EQ(take(3, {kA, kB}), kNothing);
  EXPECT_EQ(take(4, {kC, kA, kB}), kFused);
  EXPECT_EQ(take(2, {kA, kB}), kNothing) << "it came late";
  EXPECT_EQ(take(5, {kA}), kSplit);
  EXPECT_EQ(take(5, {kB, kC}), kNothing) << "they stayed together";
  EXPECT_EQ(take(6, {kA, kB}), std::pair(true, true));
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

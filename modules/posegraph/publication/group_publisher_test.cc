#include "posegraph/publication/group_publisher.h"

#include <gtest/gtest.h>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

struct Published {
  PoseGraphUpdate Publish() {
    PoseGraphUpdate update;
    publisher.Publish(&group, maps, loops, &update);
    return update;
  }

  GraphMaps maps = MakeRows(2, 3);
  GraphLoops loops;
  GraphGroup group;
  GroupPublisher publisher{7};
};

TEST(GroupPublisher, AMapIsCorrectedOnceItWasSolvedAndFromThenOn) {
  Published published;
  published.group.maps = {1};
  const PoseGraphUpdate lone = published.Publish();
  EXPECT_TRUE(lone.corrections.empty());
  ASSERT_EQ(lone.states.size(), 1u);
  EXPECT_EQ(lone.states[0].revision, 7);
  EXPECT_EQ(lone.states[0].group, RowId(2));
  ASSERT_EQ(lone.states[0].keyframes.size(), 3u);
  EXPECT_EQ(lone.states[0].keyframes[2].id, (KeyframeId{RowId(2), 2}));
  EXPECT_EQ(lone.states[0].keyframes[2].T_map_body.t, Eigen::Vector3d(2, 0, 0));
  EXPECT_FALSE(published.group.publication.unpublished);

  published.maps[1].newest_solved = 1;
  published.maps[1].Move({{0, 0, 4}, 0});
  const PoseGraphUpdate solved = published.Publish();
  ASSERT_EQ(solved.corrections.size(), 1u);
  EXPECT_EQ(solved.corrections[0].map, RowId(2));
  EXPECT_EQ(solved.corrections[0].seq, 1);
  EXPECT_EQ(solved.corrections[0].group, RowId(2));
  EXPECT_EQ(solved.corrections[0].revision, 8);
  EXPECT_EQ(solved.corrections[0].T_map_odom.t, Eigen::Vector3d(0, 0, 4));

  published.maps[1].newest_solved = -1;
  published.maps[1].Move({{0, 0, -4}, 0});
  EXPECT_EQ(published.Publish().corrections.size(), 1u);
}

TEST(GroupPublisher, TheStateSaysHowManyLoopsAreInForce) {
  Published published;
  published.group.maps = {0, 1};
  for (const int node : {0, 1, 2}) {
    Loop loop = LoopBetween({0, node}, {1, node}, {}, published.maps);
    loop.on = node > 0;
    published.loops.Add(loop);
  }
  const MapState state =
      published.publisher.StateOf(published.group, published.maps, published.loops);
  EXPECT_EQ(state.num_constraints, 2);
  EXPECT_EQ(state.num_switched_off, 1);
  EXPECT_EQ(state.revision, 7);
  EXPECT_EQ(state.maps, (std::vector<MapId>{RowId(1), RowId(2)}));
}

TEST(GroupPublisher, AGroupWithoutKeyframesIsNotToldAndUsesNoRevision) {
  Published published;
  published.group.maps = {published.maps.Add(RowId(9))};
  EXPECT_TRUE(published.Publish().states.empty());
  EXPECT_EQ(published.publisher.next_revision(), 7);
  EXPECT_FALSE(published.group.publication.unpublished);
}

}  // namespace
}  // namespace pangea

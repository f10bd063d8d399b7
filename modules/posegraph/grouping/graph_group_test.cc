#include "posegraph/grouping/graph_group.h"

#include <gtest/gtest.h>

#include "posegraph/graph/test_rows.h"

namespace pangea {
namespace {

Loop LoopOf(int from, int to) {
  Loop loop;
  loop.from.map = from;
  loop.to.map = to;
  return loop;
}

TEST(SolveSchedule, ALargerGroupWaitsForMoreLoops) {
  SolveSchedule schedule;
  EXPECT_FALSE(schedule.LoopsWaitLongEnough(100));
  schedule.AddLoop(LoopOf(2, 5));
  EXPECT_TRUE(schedule.LoopsWaitLongEnough(100));
  EXPECT_FALSE(schedule.LoopsWaitLongEnough(300));
  schedule.AddLoop(LoopOf(2, 2));
  EXPECT_TRUE(schedule.LoopsWaitLongEnough(300));
  EXPECT_EQ(schedule.changed, (std::set<int>{2, 5}));
}

TEST(SolveSchedule, LoopsWaitForSoManyKeyframesAtMost) {
  SolveSchedule schedule;
  schedule.AddKeyframe();  // nothing waits yet
  schedule.AddLoop(LoopOf(0, 0));
  for (int i = 0; i < SolveSchedule::kMaxKeyframesWaiting; ++i) {
    EXPECT_FALSE(schedule.LoopsWaitLongEnough(1000)) << i;
    schedule.AddKeyframe();
  }
  EXPECT_TRUE(schedule.LoopsWaitLongEnough(1000));
  schedule.Solved();
  EXPECT_FALSE(schedule.LoopsWaitLongEnough(0));
  EXPECT_TRUE(schedule.changed.empty());
}

TEST(SolveSchedule, NewMapsWaitUntilTheyAreSolvedTogether) {
  SolveSchedule schedule;
  EXPECT_FALSE(schedule.NewMapsWait());  // a lone map without loops
  schedule.stale = true;
  EXPECT_TRUE(schedule.NewMapsWait());
  schedule.Solved();
  EXPECT_FALSE(schedule.NewMapsWait());
}

TEST(SolveSchedule, ALargeGroupIsSolvedWholeWhenItHasGrownByATenth) {
  const PoseGraphOptions options;
  const auto large = static_cast<size_t>(options.local_keyframes) + 1;
  SolveSchedule schedule;
  EXPECT_FALSE(schedule.WholeIsDue(large, 100, options));
  schedule.AddLoop(LoopOf(0, 0));
  schedule.whole_loops = 91;
  EXPECT_FALSE(schedule.WholeIsDue(large, 100, options));
  EXPECT_TRUE(schedule.WholeIsDue(large - 1, 100, options));
  schedule.whole_loops = 90;
  EXPECT_TRUE(schedule.WholeIsDue(large, 100, options));
}

TEST(PublicationSchedule, NowAfterSoManyKeyframesAndTwoPercent) {
  for (const int num_keyframes : {1, 1000}) {
    PublicationSchedule schedule;
    schedule.Published();
    const int enough = num_keyframes == 1 ? PublicationSchedule::kMinKeyframes : 20;
    for (int i = 0; i < enough; ++i) {
      EXPECT_FALSE(schedule.now);
      schedule.AddKeyframe(num_keyframes);
      EXPECT_TRUE(schedule.unpublished);
    }
    EXPECT_TRUE(schedule.now);
    schedule.Published();
    EXPECT_FALSE(schedule.unpublished || schedule.now);
    schedule.Request();
    EXPECT_TRUE(schedule.unpublished && schedule.now);
  }
}

TEST(GraphGroup, IsTheSameAfterACheckpoint) {
  GraphGroup group;
  group.maps = {1, 4};
  group.solve.AddLoop(LoopOf(1, 4));
  group.solve.AddKeyframe();
  group.solve.regrouped = false;
  group.solve.known_loops = 7;
  group.solve.whole_loops = 5;
  group.odometry_variance = 2.5;
  group.publication.now = true;
  group.publication.keyframes = 3;
  const std::vector<uint8_t> bytes = BytesOf(group);
  GraphGroup restored;
  ByteRecordReader reader(bytes);
  restored.Restore(&reader);
  EXPECT_TRUE(reader.at_end());
  EXPECT_EQ(BytesOf(restored), bytes);
  EXPECT_EQ(restored.solve.changed, group.solve.changed);
  EXPECT_EQ(restored.odometry_variance, 2.5);
}

}  // namespace
}  // namespace pangea

#include "uplink/edit_queue.h"

#include <gtest/gtest.h>

#include "messages/testing/test_anchors.h"
#include "uplink/test_ids.h"

namespace pangea {
namespace {

constexpr double kPlenty = 1e9;

TEST(EditQueue, SendsUntilItIsAnswered) {
  EditQueue queue(kPlenty);
  EXPECT_EQ(queue.Add(TestEdit(kA, 1, 1)), EditQueue::Taken::kNew);
  EXPECT_EQ(queue.Add(TestEdit(kB, 5, 1)), EditQueue::Taken::kNew);
  EXPECT_EQ(queue.Next(1'000'000)->anchor, kA);
  EXPECT_EQ(queue.Next(1'000'000)->anchor, kB);
  EXPECT_FALSE(queue.Next(1'100'000));
  EXPECT_FALSE(queue.OnAnswer({kA, 2, true})) << "another revision";
  EXPECT_TRUE(queue.OnAnswer({kA, 1, true}));
  EXPECT_FALSE(queue.OnAnswer({kA, 1, true}));
  EXPECT_EQ(queue.Next(1'300'000)->anchor, kB);
  EXPECT_TRUE(queue.OnAnswer({kB, 5, false})) << "refused: not again either";
  EXPECT_EQ(queue.waiting(), 0u);
}

TEST(EditQueue, TheNewestRevisionStands) {
  EditQueue queue(kPlenty);
  queue.Add(TestEdit(kA, 3, 1));
  EXPECT_EQ(queue.Next(0)->revision, 3);
  EXPECT_EQ(queue.Add(TestEdit(kA, 3, 1)), EditQueue::Taken::kOutdated);
  EXPECT_EQ(queue.Add(TestEdit(kA, 2, 1)), EditQueue::Taken::kOutdated);
  EXPECT_FALSE(queue.Next(1));
  EXPECT_EQ(queue.Add(TestEdit(kA, 4, 1)), EditQueue::Taken::kNew);
  EXPECT_EQ(queue.Next(2)->revision, 4) << "at once";
  EXPECT_FALSE(queue.OnAnswer({kA, 3, true}));
  EXPECT_EQ(queue.waiting(), 1u);
}

// Renamed before the server has heard where it is.
TEST(EditQueue, WhatReplacesAnEditKeepsItsPlace) {
  EditQueue queue(kPlenty);
  AnchorEdit made = TestEdit(kA, 1, 1);
  made.placement = AnchorEdit::Placement::kPixel;
  made.pixel = {300, 200};
  made.utime = 77;
  AnchorEdit renamed = TestEdit(kA, 2, 1);
  renamed.placement = AnchorEdit::Placement::kSame;
  renamed.name = "pot";
  queue.Add(made);
  queue.Add(renamed);
  const auto sent = queue.Next(0);
  ASSERT_TRUE(sent);
  EXPECT_EQ(sent->revision, 2);
  EXPECT_EQ(sent->name, "pot");
  EXPECT_EQ(sent->placement, AnchorEdit::Placement::kPixel);
  EXPECT_EQ(sent->pixel, made.pixel);
  EXPECT_EQ(sent->map, made.map);
  EXPECT_EQ(sent->utime, 77);
}

// Another app on the agent's bus has not heard of the deletion.
TEST(EditQueue, NothingReplacesADeletion) {
  EditQueue queue(kPlenty);
  AnchorEdit deleted = TestEdit(kA, 2, 1);
  deleted.deleted = true;
  queue.Add(deleted);
  EXPECT_EQ(queue.Add(TestEdit(kA, 3, 1)), EditQueue::Taken::kOutdated);
  EXPECT_TRUE(queue.Next(0)->deleted);
}

TEST(EditQueue, IsBounded) {
  EditQueue queue(kPlenty);
  for (int i = 0; i < static_cast<int>(EditQueue::kMaxEdits); ++i) {
    ASSERT_EQ(queue.Add(TestEdit({1, i}, 1, 1)), EditQueue::Taken::kNew);
  }
  EXPECT_EQ(queue.Add(TestEdit({1, 1'000'000}, 1, 1)), EditQueue::Taken::kFull);
  EXPECT_EQ(queue.Add(TestEdit({1, 3}, 2, 1)), EditQueue::Taken::kNew) << "takes no room";
  EXPECT_EQ(queue.waiting(), EditQueue::kMaxEdits);
}

}  // namespace
}  // namespace pangea

#include "core/keyframe_store.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/keyframe_record.h"
#include "core/testing/test_record_store.h"

namespace pangea {
namespace {

const MapId kMap{1, 5};

Keyframe MakeKeyframe(int32_t seq) {
  Keyframe keyframe;
  keyframe.id = {kMap, seq};
  keyframe.camera.width = 640;
  keyframe.camera.height = 480;
  keyframe.camera.fx = keyframe.camera.fy = 400;
  keyframe.camera.cx = 320;
  keyframe.camera.cy = 240;
  keyframe.corners.resize(2);
  keyframe.corners[0].pixel = {320, 240};
  keyframe.corners[1].pixel = {420, 240};
  keyframe.corners[1].landmark_id = 77;
  keyframe.points.push_back({1, 0.5f, 0.01f});
  if (seq > 0) {
    keyframe.edge = OdometryEdge{};
    keyframe.edge->from_seq = seq - 1;
    keyframe.edge->T_from_this.t = {2, 0, 0};
  }
  return keyframe;
}

TEST(KeyframeStore, ViewUndistortsAndFindsLandmarks) {
  KeyframeStore store;
  store.Add(MakeKeyframe(0));
  const auto view = store.Find({kMap, 0});
  ASSERT_NE(view, nullptr);
  EXPECT_TRUE(view->has_ray(1));
  EXPECT_NEAR(view->ray(1).x(), 0.25, 1e-6);
  EXPECT_NEAR(view->pixel_jacobian(1)(0, 0), 400, 1e-3);
  EXPECT_EQ(view->CornersOfLandmark(77), std::vector<int>{1});
  EXPECT_TRUE(view->CornersOfLandmark(78).empty());
  EXPECT_EQ(store.Find({kMap, 1}), nullptr);
}

TEST(KeyframeStore, WindowBehindEndsWhereAKeyframeIsMissing) {
  KeyframeStore store;
  for (const int32_t seq : {0, 1, 2, 4, 5}) {
    store.Add(MakeKeyframe(seq));
  }
  const KeyframeWindow behind = store.WindowBehind({kMap, 0}, 4);
  ASSERT_EQ(behind.size(), 2u);
  EXPECT_EQ(behind[0]->keyframe().id.seq, 1);
  EXPECT_EQ(behind[1]->keyframe().id.seq, 2);
  EXPECT_EQ(store.WindowBehind({kMap, 0}, 1).size(), 1u);
  EXPECT_TRUE(store.WindowBehind({kMap, 5}, 4).empty());
}

TEST(KeyframeStore, WindowFollowsTheEdges) {
  KeyframeStore store;
  store.Add(MakeKeyframe(3));
  store.Add(MakeKeyframe(1));
  EXPECT_FALSE(store.ChainIsComplete({kMap, 1}, {kMap, 3}));
  store.Add(MakeKeyframe(2));
  EXPECT_TRUE(store.WindowIsComplete({kMap, 3}, 3));
  EXPECT_FALSE(store.WindowIsComplete({kMap, 3}, 4));  // 0 is missing
  EXPECT_TRUE(store.ChainIsComplete({kMap, 1}, {kMap, 3}));
  store.Add(MakeKeyframe(0));
  EXPECT_TRUE(store.WindowIsComplete({kMap, 3}, 9));  // the map begins at 0
  const KeyframeWindow window = store.WindowUpTo({kMap, 3}, 3);
  ASSERT_EQ(window.size(), 3u);
  EXPECT_EQ(window[0]->keyframe().id.seq, 1);
  EXPECT_EQ(window[2]->keyframe().id.seq, 3);
  EXPECT_NEAR(*store.PathBetween({kMap, 1}, {kMap, 3}), 4.0, 1e-12);
}

TEST(KeyframeStore, ABridgedGapIsNoGap) {
  KeyframeStore store;
  store.Add(MakeKeyframe(0));
  Keyframe bridged = MakeKeyframe(5);
  bridged.edge->from_seq = 0;
  store.Add(bridged);
  EXPECT_TRUE(store.WindowIsComplete({kMap, 5}, 5));
  EXPECT_EQ(store.WindowUpTo({kMap, 5}, 5).size(), 2u);
  EXPECT_TRUE(store.PathBetween({kMap, 0}, {kMap, 5}));
  EXPECT_FALSE(store.PathBetween({kMap, 3}, {kMap, 5}));
}

TEST(KeyframeStore, GoesOnAfterWhatWasLost) {
  KeyframeStore store;
  for (const int seq : {0, 1, 4, 5}) {
    Keyframe keyframe = MakeKeyframe(seq);
    keyframe.T_odom_body.t = {2.0 * seq, 0, 0};
    store.Add(keyframe);
  }
  EXPECT_FALSE(store.WindowIsComplete({kMap, 5}, 5));
  EXPECT_FALSE(store.ChainIsComplete({kMap, 0}, {kMap, 5}));
  store.NoteLost(kMap, 2, 3);
  EXPECT_TRUE(store.WindowIsComplete({kMap, 5}, 5));
  EXPECT_EQ(store.WindowUpTo({kMap, 5}, 5).size(), 2u);
  EXPECT_TRUE(store.ChainIsComplete({kMap, 0}, {kMap, 5}));
  EXPECT_NEAR(store.PathBetween({kMap, 0}, {kMap, 5}).value_or(0), 10.0, 1e-12);
  EXPECT_TRUE(store.WindowIsComplete({kMap, 3}, 5));  // no more of it will come
  EXPECT_TRUE(store.WindowUpTo({kMap, 3}, 5).empty());
}

// The answers of a store about a map with gaps. They must not depend on the order of the queries.
std::vector<std::vector<uint8_t>> Answers(KeyframeStore store) {
  for (int seq = 0; seq < 60; ++seq) {
    if (seq % 20 != 13) {
      store.Add(MakeKeyframe(seq));
    }
  }
  std::vector<std::vector<uint8_t>> answers;
  for (const int seq : {5, 59, 0, 30, 17, 58, 5, 31}) {
    for (const auto& view : store.WindowUpTo({kMap, seq}, 5)) {
      answers.push_back(ToRecord(view->keyframe()));
    }
    const double path_m = store.PathBetween({kMap, seq - 4}, {kMap, seq}).value_or(-1);
    answers.push_back({static_cast<uint8_t>(path_m),
                       static_cast<uint8_t>(store.ChainIsComplete({kMap, 0}, {kMap, seq}))});
  }
  return answers;
}

TEST(KeyframeStore, SaysTheSameWhateverLiesWhere) {
  const auto expected = Answers(KeyframeStore({.max_views = 10000}));
  EXPECT_GT(expected.size(), 30u);
  EXPECT_EQ(Answers(KeyframeStore({.max_views = 1})), expected);
  EXPECT_EQ(
      Answers(KeyframeStore({.max_views = 10}, std::make_shared<test::TestRecordStore>(10000))),
      expected);
  EXPECT_EQ(Answers(KeyframeStore({.max_views = 10}, std::make_shared<test::TestRecordStore>(20))),
            expected);
}

TEST(KeyframeStore, WhatFindsNoRoomStaysInMemoryAndIsBoundedThere) {
  KeyframeStore store({.max_in_memory = 3, .max_views = 2},
                      std::make_shared<test::TestRecordStore>(2));
  for (int seq = 0; seq < 7; ++seq) {
    store.Add(MakeKeyframe(seq));
    EXPECT_NE(store.Find({kMap, seq}), nullptr);
  }
  EXPECT_EQ(store.size(), 5u);
  EXPECT_EQ(store.counters().in_memory, 3);
  EXPECT_EQ(store.counters().dropped, 2);
  for (const int seq : {0, 1, 4, 5, 6}) {
    EXPECT_NE(store.Find({kMap, seq}), nullptr) << seq;
  }
  EXPECT_FALSE(store.Contains({kMap, 2}));
  EXPECT_EQ(store.Find({kMap, 3}), nullptr);
}

// Nobody waits for what the store itself has dropped: it will not come again.
TEST(KeyframeStore, WhatWasDroppedIsLost) {
  KeyframeStore store({.max_in_memory = 3});
  for (int seq = 0; seq < 7; ++seq) {
    store.Add(MakeKeyframe(seq));
  }
  ASSERT_EQ(store.counters().dropped, 4);
  EXPECT_TRUE(store.WindowIsComplete({kMap, 6}, 5));
  EXPECT_EQ(store.WindowUpTo({kMap, 6}, 5).size(), 3u);
  EXPECT_TRUE(store.WindowIsComplete({kMap, 2}, 5));
  EXPECT_TRUE(store.WindowUpTo({kMap, 2}, 5).empty());
  EXPECT_TRUE(store.ChainIsComplete({kMap, 1}, {kMap, 6}));
  EXPECT_FALSE(store.WindowIsComplete({kMap, 7}, 5)) << "that one may still come";
}

TEST(KeyframeStore, WhatCannotBeReadIsNotThere) {
  const auto records = std::make_shared<test::TestRecordStore>(100);
  KeyframeStore store({.max_views = 1}, records);
  store.Add(MakeKeyframe(0));
  store.Add(MakeKeyframe(1));
  records->broken = true;
  EXPECT_EQ(store.Find({kMap, 0}), nullptr);
  EXPECT_TRUE(store.WindowUpTo({kMap, 1}, 2).empty());
  EXPECT_EQ(store.counters().unreadable, 2);
  records->broken = false;
  EXPECT_EQ(store.WindowUpTo({kMap, 1}, 2).size(), 2u);
}

TEST(KeyframeStore, RestoresAllOfItsBytesOrNothing) {
  const auto records = std::make_shared<test::TestRecordStore>(100);
  KeyframeStore store({}, records);
  store.Add(MakeKeyframe(0));
  store.Add(MakeKeyframe(1));
  ByteRecordWriter writer;
  store.Save(&writer);
  const std::vector<uint8_t> bytes = writer.Take();
  for (const int off : {-1, 1}) {
    std::vector<uint8_t> wrong = bytes;
    wrong.resize(bytes.size() + off);
    KeyframeStore unchanged({}, records);
    unchanged.Add(MakeKeyframe(7));
    ByteRecordReader reader(wrong);
    EXPECT_FALSE(unchanged.Restore(&reader)) << off;
    EXPECT_EQ(unchanged.size(), 1u) << off;
    EXPECT_NE(unchanged.Find({kMap, 7}), nullptr) << off;
  }
  // After the count and the first keyframe's id (map and seq) comes the place of its record.
  std::vector<uint8_t> nowhere = bytes;
  std::fill_n(nowhere.begin() + 20, sizeof(int64_t), 0xff);
  ByteRecordReader of_nowhere(nowhere);
  EXPECT_FALSE(KeyframeStore({}, records).Restore(&of_nowhere));
  KeyframeStore restored({}, records);
  ByteRecordReader reader(bytes);
  ASSERT_TRUE(restored.Restore(&reader));
  EXPECT_EQ(restored.WindowUpTo({kMap, 1}, 2).size(), 2u);
}

TEST(KeyframeStore, IsBounded) {
  KeyframeStore store({.max_in_memory = 3, .max_views = 2});
  for (int seq = 0; seq < 5; ++seq) {
    store.Add(MakeKeyframe(seq));
    EXPECT_NE(store.Find({kMap, seq}), nullptr);
  }
  EXPECT_EQ(store.size(), 3u);
  EXPECT_FALSE(store.Contains({kMap, 1}));
  for (int seq = 2; seq < 5; ++seq) {
    EXPECT_NE(store.Find({kMap, seq}), nullptr);  // a view that was dropped is made again
  }
}

}  // namespace
}  // namespace pangea

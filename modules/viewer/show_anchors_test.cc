// Anchors in both shows: as a log has them at its time, and on a bus, where people change them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "anchors/anchors.h"
#include "log_file/log_writer.h"
#include "messages/anchor_messages.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "viewer/log_show.h"
#include "viewer/viewer_process.h"
#include "viewer/viewer_test_world.h"

namespace pangea::viewer {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

TEST(AnchorsOfALog, AreShownAsTheyWereAtTheTime) {
  const std::string path = testing::TempDir() + "viewer_anchors.lcm";
  {
    LogFileWriter log(path);
    AnchorState anchor = TestAnchor(3, TestMap(1));
    for (int second = 0; second < 10; ++second) {
      anchor.T_odom_anchor.t.x() = second < 5 ? 1 : 2;
      anchor.gone = second == 9;
      log.Write(kStart + second * kSecond, "ANCHOR", EncodeMessage(ToMessage(anchor)));
    }
    log.Write(kStart + 10 * kSecond, "ANCHOR", std::vector<uint8_t>(50, 0xff));
  }
  LogShow show(path);
  EXPECT_EQ(show.num_refused(), 1);
  EXPECT_EQ(show.NumAnchorStates(), 3U) << "repetitions are left out";
  EXPECT_FALSE(show.editable());
  EXPECT_THAT(show.scene().anchors(), IsEmpty());
  show.Seek(4.5);
  EXPECT_EQ(show.scene().anchors().at(0).T_odom_anchor.t.x(), 1);
  show.Seek(6);
  EXPECT_EQ(show.scene().anchors().at(0).T_odom_anchor.t.x(), 2);
  show.Seek(9);
  EXPECT_TRUE(show.scene().anchors().at(0).gone);
  show.Seek(2);
  EXPECT_EQ(show.scene().anchors().at(0).T_odom_anchor.t.x(), 1);
}

class LiveAnchors : public testing::Test {
 protected:
  LiveAnchors() {
    bus_.Subscribe("ANCHOR_REQUEST_0", [this](const std::string&, Bytes data) {
      anchor_edit_t message{};
      ASSERT_TRUE(DecodeMessage(data, &message));
      const Parsed<AnchorEdit> edit = Parse(message);
      ASSERT_TRUE(edit.value) << edit.refused;
      requests_.push_back(*edit.value);
    });
    TickAt(1);
  }

  void TickAt(double time_s) {
    process_.Tick(kStart + static_cast<int64_t>(1e6 * time_s));
    bus_.Drain();
  }
  void Say(const std::string& channel, const auto& message) {
    PublishMessage(bus_, channel, message);
    bus_.Drain();
  }
  // As if the page of a viewer that saw a keyframe and an anchor moved that.
  void MoveKnownAnchor() { process_.Change({AnchorId{1, 3}, false, "", 0, {0, 0, 2}}); }

  LocalBus bus_;
  ViewerProcess process_{bus_, "memory", kStart};
  std::vector<AnchorEdit> requests_;
};

Keyframe FirstKeyframe() {
  Keyframe keyframe;
  keyframe.id = {TestMap(1), 0};
  keyframe.utime = 77;
  keyframe.camera.width = 752;
  keyframe.camera.height = 480;
  keyframe.camera.fx = keyframe.camera.fy = 460;
  keyframe.camera.cx = 376;
  keyframe.camera.cy = 240;
  return keyframe;
}

class LiveAnchorsWithMap : public LiveAnchors {
 protected:
  LiveAnchorsWithMap() {
    Say("KEYFRAME_1", ToMessage(FirstKeyframe()));
    Say("ANCHOR", ToMessage(TestAnchor(3, TestMap(1))));
    EXPECT_THAT(process_.scene().keyframes(), SizeIs(1));
    EXPECT_THAT(process_.scene().anchors(), SizeIs(1));
  }
};

TEST_F(LiveAnchorsWithMap, ARequestIsRepeatedUntilTheJournalHasIt) {
  ASSERT_TRUE(process_.editable());
  process_.Change({std::nullopt, false, "kettle", 0, {0, 0, 2}});
  for (const double time_s : {1.1, 1.2, 2.2}) {
    TickAt(time_s);
  }
  ASSERT_THAT(requests_, SizeIs(2));
  EXPECT_EQ(requests_[0].anchor, (AnchorId{0, kStart + kSecond}));
  EXPECT_EQ(requests_[1].anchor, requests_[0].anchor);
  EXPECT_EQ(requests_[0].name, "kettle");
  EXPECT_EQ(requests_[0].map, TestMap(1));
  EXPECT_EQ(requests_[0].utime, 77);
  EXPECT_LT((requests_[0].T_ref_anchor.t - Eigen::Vector3d(0, 0, 2)).norm(), 1e-9);
  AnchorEdit journalled = requests_[0];
  journalled.seq = 4;
  Say("ANCHOR_EDIT", ToMessage(journalled));
  for (double time_s = 3; time_s < 40; time_s += 0.5) {
    TickAt(time_s);
  }
  EXPECT_THAT(requests_, SizeIs(2));
  EXPECT_EQ(process_.scene().notice().text, "");
}

// Two viewers move one anchor at once: both edits have the next revision, and the journal takes the
// first.
TEST_F(LiveAnchorsWithMap, PagesAreToldWhenAnotherEditCameFirst) {
  MoveKnownAnchor();
  TickAt(1.1);
  ASSERT_THAT(requests_, SizeIs(1));
  EXPECT_EQ(requests_[0].revision, 2);
  AnchorEdit of_another = requests_[0];
  of_another.T_ref_anchor.t.x() += 1;
  of_another.seq = 4;
  Say("ANCHOR_EDIT", ToMessage(of_another));
  EXPECT_EQ(process_.scene().notice().text,
            "\"anchor 3\" was not changed: another edit came first");
  TickAt(2.5);
  EXPECT_THAT(requests_, SizeIs(1));
}

// ANCHOR does not tell whose edit it shows.
TEST_F(LiveAnchorsWithMap, TheAnchorAloneIsNoAnswer) {
  MoveKnownAnchor();
  TickAt(1.1);
  AnchorState moved = TestAnchor(3, TestMap(1));
  moved.revision = 2;
  Say("ANCHOR", ToMessage(moved));
  TickAt(2.5);
  EXPECT_THAT(requests_, SizeIs(2));
}

TEST_F(LiveAnchorsWithMap, AnAnchorThatIsMovedAgainBeforeItIsShownMovesAgain) {
  MoveKnownAnchor();
  TickAt(1.1);
  ASSERT_THAT(requests_, SizeIs(1));
  Say("ANCHOR_EDIT", ToMessage(requests_[0]));
  MoveKnownAnchor();
  TickAt(1.2);
  ASSERT_THAT(requests_, SizeIs(2));
  EXPECT_EQ(requests_[1].revision, 3);
}

TEST_F(LiveAnchorsWithMap, PagesAreToldWhenNobodyAnswers) {
  MoveKnownAnchor();
  for (double time_s = 1; time_s < 30; time_s += 0.1) {
    TickAt(time_s);
  }
  EXPECT_THAT(requests_, SizeIs(20));
  EXPECT_EQ(process_.scene().notice().text, "\"anchor 3\": the server did not confirm the change");
}

TEST_F(LiveAnchors, PagesAreToldOfWhatIsNotThere) {
  MoveKnownAnchor();
  TickAt(2);
  EXPECT_THAT(requests_, IsEmpty());
  EXPECT_THAT(process_.scene().notice().text, HasSubstr("no longer there"));
}

// Several keyframes hold it, which the optimised map has elsewhere than their odometry.
TEST_F(LiveAnchorsWithMap, AMovedAnchorComesOutWhereItWasMoved) {
  Anchors server{AnchorsOptions()};
  Keyframe keyframe = FirstKeyframe();
  server.Take(keyframe);
  while (++keyframe.id.seq < 10) {
    keyframe.utime += kSecond / 4;
    keyframe.T_odom_body.t.x() += 0.3;
    keyframe.edge = OdometryEdge{keyframe.id.seq - 1, Rigid3(), 1e-6 * Matrix6d::Identity()};
    keyframe.edge->T_from_this.t.x() = 0.3;
    server.Take(keyframe);
    Say("KEYFRAME_1", ToMessage(keyframe));
  }
  MapState bent = TestState({TestMap(1)}, 9, 1);
  for (KeyframePose& pose : bent.keyframes) {
    pose.T_map_body = {YawRotation(0.01 * pose.id.seq), {0.31 * pose.id.seq, 0, 0}};
  }
  server.Take(bent);
  for (const map_state_t& chunk : ToMessages(bent)) {
    Say("MAP_STATE", chunk);
  }
  const Eigen::Vector3d p_body(0.1, 0.5, 3);
  process_.Change({AnchorId{1, 3}, false, "", 4, p_body});
  TickAt(1.1);
  ASSERT_THAT(requests_, SizeIs(1));
  requests_[0].right = AnchorRight::kEditAll;
  ASSERT_EQ(server.Take(requests_[0]), "");
  const Eigen::Vector3d p_map = bent.keyframes[4].T_map_body * p_body;
  EXPECT_LT((server.All().at(0).T_odom_anchor.t - p_map).norm(), 1e-4);
}

// Two made within one tick are two.
TEST_F(LiveAnchorsWithMap, NoTwoAnchorsHaveOneId) {
  process_.Change({std::nullopt, false, "a", 0, {0, 0, 2}});
  process_.Change({std::nullopt, false, "b", 0, {0, 0, 2}});
  TickAt(2);
  ASSERT_THAT(requests_, SizeIs(2));
  EXPECT_NE(requests_[0].anchor, requests_[1].anchor);
}

TEST_F(LiveAnchors, AViewerMayBeThereToLook) {
  ViewerProcess looks(bus_, "memory", kStart, ViewerProcess::Pages::kLook);
  EXPECT_FALSE(looks.editable());
}

}  // namespace
}  // namespace pangea::viewer

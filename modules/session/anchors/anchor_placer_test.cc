// Tests when an anchor is requested, the request's contents, and when requests end.

#include "session/anchors/anchor_placer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pangea::session {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr int64_t kSecond = 1'000'000;
constexpr int64_t kImage = 500 * kSecond;  // the image that shows it
constexpr int64_t kNow = 1'700'000'000 * kSecond;
const MapId kPlacedMap{2, 77};
const MapId kLater{2, 88};

PlannedAnchor Kettle() { return {{2, 12, "kettle", {376, 240}, "{}"}, kImage}; }

// One agent whose odometry tracks from `from` on, in one map.
AnchorPlacer TrackedFrom(int64_t from) {
  AnchorPlacer placer({Kettle()});
  for (int64_t utime = from; utime <= kImage + kSecond; utime += kSecond / 20) {
    placer.OnPose(2, utime, kPlacedMap, kNow + utime - kImage);
  }
  return placer;
}

TEST(AnchorPlacer, RequestsTheAnchorAtTheImageThatShowsIt) {
  AnchorPlacer placer = TrackedFrom(kImage - 3 * kSecond);
  const std::vector<AnchorEdit> due = placer.TakeDue(kNow + kSecond);
  ASSERT_EQ(due.size(), 1u);
  const AnchorEdit& edit = due.front();
  EXPECT_EQ(edit.anchor, (AnchorId{2, kNow}));
  EXPECT_EQ(edit.agent_id, 2);
  EXPECT_EQ(edit.revision, 1);
  EXPECT_EQ(edit.seq, -1);
  EXPECT_EQ(edit.name, "kettle");
  EXPECT_EQ(edit.payload, "{}");
  EXPECT_EQ(edit.placement, AnchorEdit::Placement::kPixel);
  EXPECT_EQ(edit.map, kPlacedMap);
  EXPECT_EQ(edit.utime, kImage);
  EXPECT_EQ(edit.pixel, Eigen::Vector2d(376, 240));
  EXPECT_FALSE(edit.deleted);
}

TEST(AnchorPlacer, NothingIsRequestedBeforeTheImage) {
  AnchorPlacer placer({Kettle()});
  placer.OnPose(2, kImage - kSecond / 20, kPlacedMap, kNow);
  placer.OnPose(1, kImage + kSecond, MapId{1, 5}, kNow);  // another agent
  EXPECT_THAT(placer.TakeDue(kNow), IsEmpty());
  placer.OnPose(2, kImage, kPlacedMap, kNow);
  EXPECT_EQ(placer.TakeDue(kNow).size(), 1u);
}

TEST(AnchorPlacer, RepeatsUntilTheAgentHasHeardOfIt) {
  AnchorPlacer placer = TrackedFrom(kImage - kSecond);
  const auto first = placer.TakeDue(kNow);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_THAT(placer.TakeDue(kNow + kSecond - 1), IsEmpty());
  const auto again = placer.TakeDue(kNow + kSecond);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again.front().anchor, first.front().anchor) << "the same anchor, not another";
  placer.OnAnchor(2, {2, 5}, 1);                // another anchor
  placer.OnAnchor(1, first.front().anchor, 1);  // on another agent's bus
  placer.OnAnchor(2, first.front().anchor, 0);
  EXPECT_EQ(placer.TakeDue(kNow + 2 * kSecond).size(), 1u);
  EXPECT_THAT(placer.NotPlaced(), ElementsAre(HasSubstr("heard of none")));
  placer.OnAnchor(2, first.front().anchor, 1);
  EXPECT_THAT(placer.TakeDue(kNow + 10 * kSecond), IsEmpty());
  EXPECT_THAT(placer.NotPlaced(), IsEmpty());
}

TEST(AnchorPlacer, WithoutTrackingTheFirstImageThatIsTrackedIsTaken) {
  const int64_t late = kImage + kSecond / 2;
  EXPECT_EQ(TrackedFrom(late).TakeDue(kNow + kSecond).at(0).utime, late);
  AnchorPlacer placer({Kettle()});
  placer.OnPose(2, kImage - kSecond, kPlacedMap, kNow);
  placer.OnPose(2, kImage - 1, std::nullopt, kNow);
  placer.OnPose(2, kImage, std::nullopt, kNow);
  EXPECT_THAT(placer.TakeDue(kNow), IsEmpty());
  placer.OnPose(2, late, kPlacedMap, kNow);
  EXPECT_EQ(placer.TakeDue(kNow).at(0).utime, late) << "tracking was lost between";
}

TEST(AnchorPlacer, AMapOpenedAfterTheImageHasNoneOfIt) {
  AnchorPlacer placer({Kettle()});
  placer.OnPose(2, kImage - kSecond, kPlacedMap, kNow);
  placer.OnPose(2, kImage + 7, kLater, kNow);
  const AnchorEdit edit = placer.TakeDue(kNow).at(0);
  EXPECT_EQ(edit.map, kLater);
  EXPECT_EQ(edit.utime, kImage + 7);
}

TEST(AnchorPlacer, StoredKeyframesAroundTheImageAreEnough) {
  AnchorPlacer placer({Kettle()});
  placer.OnPose(2, kImage - kSecond / 5, kPlacedMap, kNow);
  placer.OnPose(2, kImage + kSecond / 5, kPlacedMap, kNow);
  EXPECT_EQ(placer.TakeDue(kNow).at(0).utime, kImage);
}

TEST(AnchorPlacer, NoTwoAnchorsShareAnId) {
  PlannedAnchor second = Kettle();
  second.script.name = "pot";
  AnchorPlacer placer({Kettle(), second});
  placer.OnPose(2, kImage, kPlacedMap, kNow);
  const auto due = placer.TakeDue(kNow);
  ASSERT_EQ(due.size(), 2u);
  EXPECT_NE(due[0].anchor, due[1].anchor);
}

TEST(AnchorPlacer, SaysWhatWasNeverRequested) {
  AnchorPlacer placer({Kettle()});
  placer.OnPose(2, kImage - kSecond, kPlacedMap, kNow);
  EXPECT_THAT(placer.NotPlaced(),
              ElementsAre("agent 2: anchor kettle was never placed: the odometry did not track at "
                          "12 s or later"));
}

}  // namespace
}  // namespace pangea::session

#include "viewer/scene/agent_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pangea::viewer {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

const MapId kMap = {1, 5};

// Landmarks `from` .. `to`, each a pixel further right with every keyframe.
ShownCorners Corners(int32_t seq, int32_t from, int32_t to, const MapId& map = kMap) {
  ShownCorners corners{map, seq, seq * kSecond, 752, 480, {}};
  for (int32_t landmark = from; landmark <= to; ++landmark) {
    corners.pixels[landmark] =
        Eigen::Vector2f(static_cast<float>(100 * landmark + seq), static_cast<float>(landmark));
  }
  return corners;
}

std::shared_ptr<const ShownImage> Image(int64_t utime, size_t bytes = 10) {
  return std::make_shared<const ShownImage>(
      ShownImage{1, utime, 1, 752, 480, std::vector<uint8_t>(bytes)});
}

TEST(AgentView, TracksGoBackAsFarAsTheyAreUnbroken) {
  AgentView view;
  view.Take(Corners(0, 1, 2));
  view.Take(Corners(1, 2, 2));
  view.Take(Corners(2, 1, 3));
  const auto tracks = view.Tracks();
  ASSERT_THAT(tracks, SizeIs(3));
  EXPECT_THAT(tracks[0], ElementsAre(Eigen::Vector2f(102, 1)));
  EXPECT_THAT(tracks[1], ElementsAre(Eigen::Vector2f(202, 2), Eigen::Vector2f(201, 2),
                                     Eigen::Vector2f(200, 2)));
  EXPECT_THAT(tracks[2], ElementsAre(Eigen::Vector2f(302, 3)));
}

TEST(AgentView, WhatIsRetransmittedChangesNothing) {
  AgentView view;
  view.Take(Corners(4, 1, 1));
  const int64_t number = view.number();
  view.Take(Corners(3, 1, 9));
  view.Take(Corners(7, 1, 9, {1, 4}));
  EXPECT_EQ(view.number(), number);
  EXPECT_THAT(view.Tracks(), SizeIs(1));
  view.Take(Corners(0, 1, 9, {1, 6}));
  EXPECT_THAT(view.Tracks(), SizeIs(9)) << "a new map begins anew";
}

// A keyframe comes after later images; it is shown with its own.
TEST(AgentView, AKeyframeFindsItsImage) {
  AgentView view;
  for (int i = 0; i < 40; ++i) {
    view.Take(Image(i * kSecond / 10));
  }
  EXPECT_EQ(view.image()->utime, 39 * kSecond / 10) << "without a keyframe the newest";
  view.Take(Corners(2, 1, 1));
  EXPECT_EQ(view.image()->utime, 2 * kSecond);
  view.Take(Corners(9, 1, 1));
  EXPECT_EQ(view.image(), nullptr) << "none of that time";
}

TEST(AgentView, ImagesThatWaitAreBounded) {
  AgentView view;
  view.Take(Image(0));
  for (size_t i = 1; i <= AgentView::kMaxImages; ++i) {
    view.Take(Image(static_cast<int64_t>(i) * kSecond));
  }
  view.Take(Corners(0, 1, 1));
  EXPECT_EQ(view.image(), nullptr) << "the oldest had to go";
  view.Take(Image(2000 * kSecond, AgentView::kMaxImageBytes));
  view.Take(Image(2001 * kSecond));
  view.Take(Corners(2000, 1, 1));
  EXPECT_EQ(view.image(), nullptr);
}

}  // namespace
}  // namespace pangea::viewer

// Tests precision and recall on hand-made candidates, overlap on known views, and the whole
// pipeline on the captured session.

#include <gtest/gtest.h>

#include <numbers>

#include "bench/recognition/curve.h"
#include "bench/recognition/input.h"
#include "bench/recognition/overlap.h"
#include "bench/recognition/report.h"
#include "core/testing/test_cameras.h"

namespace pangea::bench {
namespace {

KeyframeId Id(int32_t seq) { return {{1, 1000}, seq}; }

// Keyframes 1 to 4 have a place to be recognised; 5 has none, so no candidate of it can be right.
const std::vector<KeyframeId> kWithOverlap = {Id(1), Id(2), Id(3), Id(4)};
const std::vector<Scored> kScored = {
    {Id(1), 0.9, true, true},  {Id(1), 0.8, true, true},   {Id(2), 0.8, false, true},
    {Id(2), 0.5, true, false}, {Id(3), 0.7, false, false}, {Id(5), 0.6, false, true},
};

TEST(Curve, CountsWhatTheSystemLetsPass) {
  const PrecisionRecall decided = AsDecided(kScored, kWithOverlap);
  EXPECT_EQ(decided.passed, 4u);
  EXPECT_EQ(decided.right, 2u);
  EXPECT_EQ(decided.found, 1u);  // both right ones are keyframe 1's
  EXPECT_DOUBLE_EQ(decided.precision, 0.5);
  EXPECT_DOUBLE_EQ(decided.recall, 0.25);
}

TEST(Curve, EqualScoresPassTogether) {
  const std::vector<PrecisionRecall> curve = OverThresholds(kScored, kWithOverlap);
  ASSERT_EQ(curve.size(), 5u);
  EXPECT_EQ(curve[0].passed, 1u);
  EXPECT_DOUBLE_EQ(curve[0].precision, 1);
  EXPECT_EQ(curve[1].passed, 3u);
  EXPECT_DOUBLE_EQ(curve[1].precision, 2.0 / 3);
  EXPECT_DOUBLE_EQ(curve[1].recall, 0.25);
  EXPECT_EQ(curve.back().passed, kScored.size());
  EXPECT_DOUBLE_EQ(curve.back().recall, 0.5);
}

TEST(Curve, NothingIsNoValue) {
  EXPECT_EQ(AsDecided({}, kWithOverlap).recall, 0);
  EXPECT_EQ(AsDecided(kScored, {}).recall, 0);
  EXPECT_TRUE(OverThresholds({}, kWithOverlap).empty());
}

// A wall of points four metres ahead, spread over the image.
View WallView(const Rigid3& T_reference_cam, const std::vector<Eigen::Vector3d>& p_reference) {
  View view{PinholeTestCamera(640, 480, 400), T_reference_cam, p_reference};
  view.camera.T_body_cam = {};
  return view;
}
std::vector<Eigen::Vector3d> Wall() {
  std::vector<Eigen::Vector3d> points;
  for (int x = -3; x <= 3; ++x) {
    for (int y = -2; y <= 2; ++y) {
      points.emplace_back(x, y, 4);
    }
  }
  return points;
}

TEST(Overlap, IsWholeFromTheSamePlaceAndNoneFromBehind) {
  const View here = WallView({}, Wall());
  EXPECT_EQ(Overlap(here, here), 1);
  const View back = WallView({ExpSo3({0, std::numbers::pi, 0}), {0, 0, 0}}, {{0, 0, -4}});
  EXPECT_EQ(Overlap(here, back), 0);
  // From the other side of the wall.
  const View behind = WallView({ExpSo3({0, std::numbers::pi, 0}), {0, 0, 8}}, Wall());
  EXPECT_EQ(Overlap(here, behind), 0);
}

TEST(Overlap, IsTheShareOfPointsInView) {
  const View here = WallView({}, Wall());
  // Three metres to the right: the left three of seven columns leave the image.
  const View right = WallView({Eigen::Quaterniond::Identity(), {3, 0, 0}}, {});
  EXPECT_NEAR(Overlap(here, right), 0.5 * 4 / 7, 1e-9);
}

TEST(Overlap, EndsWhereDistancesDifferTooMuch) {
  const View here = WallView({}, Wall());
  EXPECT_GT(Overlap(here, WallView({Eigen::Quaterniond::Identity(), {0, 0, -3}}, {})), 0.4);
  EXPECT_EQ(Overlap(here, WallView({Eigen::Quaterniond::Identity(), {0, 0, -9}}, {})), 0);
}

// Two walks through one hall. The reference is the expected result of the replay, some centimetres
// from the truth: negligible for overlaps, which are a matter of metres and tens of degrees.
TEST(Recognition, FindsWhereTwoWalksMeet) {
  const std::string sample = std::string(PANGEA_SOURCE_DIR) + "/logs/two_walks";
  const std::string log = sample + "/session.lcm";
  const Input input = ReadInput(
      {{1, log, sample + "/expected/agent_1.tum"}, {2, log, sample + "/expected/agent_2.tum"}});
  const Outcome outcome = RunStages(input.keyframes, input.truth);
  EXPECT_EQ(outcome.keyframes, input.keyframes.size());
  ASSERT_TRUE(outcome.with_overlap.contains(Search::kOtherMaps));
  const std::vector<KeyframeId>& with_overlap = outcome.with_overlap.at(Search::kOtherMaps);
  EXPECT_GT(with_overlap.size(), 5u);
  std::vector<PrecisionRecall> stages;
  for (size_t stage = 0; stage < kStages.size(); ++stage) {
    stages.push_back(AsDecided(AtStage(outcome, Search::kOtherMaps, stage), with_overlap));
    if (stage > 0) {
      EXPECT_LE(stages[stage].passed, stages[stage - 1].passed) << kStages[stage];
      EXPECT_LE(stages[stage].found, stages[stage - 1].found) << kStages[stage];
    }
  }
  EXPECT_GT(stages.back().found, with_overlap.size() / 2);
  EXPECT_EQ(stages.back().precision, 1);
  EXPECT_LT(stages.front().precision, 1);  // or there was nothing to reject
  std::cout << Table(outcome);
}

}  // namespace
}  // namespace pangea::bench

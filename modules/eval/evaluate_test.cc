#include "eval/evaluate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "eval/table.h"

namespace pangea {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;

EvaluationInput Input(const std::string& name, double offset_m) {
  EvaluationInput input{name, {}, {}};
  for (int i = 0; i < 300; ++i) {
    const double s = 0.05 * i;
    const Rigid3 T(YawRotation(s), {std::cos(s), s, std::sin(2 * s)});
    input.reference.push_back({i * int64_t{50'000}, T});
    input.estimate.push_back({i * int64_t{50'000}, Rigid3({1, 0, 0, 0}, {7 + offset_m, 8, 9}) * T});
  }
  return input;
}

TEST(Evaluate, TablesAndJsonAgree) {
  const AbsoluteEvaluation evaluation =
      EvaluateAbsolute({Input("one.tum", 0), Input("two.tum", 0.2)}, 0.1);
  const auto json = ToJson(evaluation);
  EXPECT_NEAR(json["SE(3)"]["ate_m"]["rmse"].get<double>(), 0.1, 1e-9);
  EXPECT_EQ(json["SE(3)"]["trajectories"][1]["name"], "two.tum");
  EXPECT_NEAR(json["yaw"]["trajectories"][0]["coverage"].get<double>(), 1, 1e-9);
  const std::string text = ToText(evaluation);
  EXPECT_THAT(text, HasSubstr("| SE(3)     | all together | 600   | 0.1000"));
  EXPECT_THAT(text, HasSubstr("two.tum"));
}

TEST(Evaluate, RelativeRowsWithoutAStretchSayNothing) {
  const RelativeEvaluation evaluation = EvaluateRelative(Input("one", 0), {1, 1000}, {2}, 0.1);
  const auto json = ToJson(evaluation);
  EXPECT_LT(json["over_distance"][0]["position_m"]["max"].get<double>(), 1e-9);
  EXPECT_TRUE(json["over_distance"][1]["position_m"].is_null());
  EXPECT_EQ(json["over_time"][0]["duration_s"], 2.0);
  EXPECT_THAT(ToText(evaluation), HasSubstr("| 1000 m | 0"));
}

TEST(Evaluate, PositionsAloneHaveAnAteAndNoRotationError) {
  EvaluationInput positions = Input("positions.txt", 0);
  for (StampedPose& pose : positions.estimate) {
    pose.T.q.setIdentity();
  }
  positions.has_rotations = false;
  const AbsoluteEvaluation evaluation = EvaluateAbsolute({positions, Input("poses.tum", 0)}, 0.1);
  const auto json = ToJson(evaluation)["SE(3)"]["trajectories"];
  EXPECT_LT(json[0]["ate_m"]["max"].get<double>(), 1e-9);
  EXPECT_TRUE(json[0]["rotation_deg"].is_null());
  EXPECT_FALSE(json[1]["rotation_deg"].is_null());
  EXPECT_THAT(ToText(evaluation),
              AllOf(HasSubstr("positions.txt: positions alone, so no rotation error\n"),
                    HasSubstr("| 0.0000 | -                 | 1.0000 |")));
  EXPECT_THAT([&] { EvaluateRelative(positions, {1}, {1}, 0.1); },
              ThrowsMessage<std::runtime_error>(HasSubstr("positions.txt: it or its reference has "
                                                          "positions alone")));
}

TEST(Evaluate, TwoThatAreProbablySwappedAreNamed) {
  EvaluationInput input = Input("truth.csv", 0);
  EXPECT_THAT(SwappedWarnings(input), IsEmpty());
  Trajectory thin;
  for (size_t i = 0; i < input.estimate.size(); i += 10) {
    thin.push_back(input.estimate[i]);
  }
  std::swap(input.estimate, thin);
  EXPECT_THAT(SwappedWarnings(input), IsEmpty()) << "keyframes and their ground truth";
  std::swap(input.estimate, thin);
  input.reference = thin;
  EXPECT_THAT(SwappedWarnings(input),
              ElementsAre(HasSubstr("truth.csv: it has 20.0 poses a second, its reference only "
                                    "2.0: are the two swapped?")));
  input.reference.clear();
  EXPECT_THAT(SwappedWarnings(input), IsEmpty());
}

TEST(Evaluate, NoCommonTimeIsAnError) {
  EvaluationInput input = Input("late.tum", 0);
  for (StampedPose& pose : input.estimate) {
    pose.utime += 1'000'000'000;
  }
  const auto says_so =
      ThrowsMessage<std::runtime_error>(HasSubstr("late.tum: 0 of 300 poses associated"));
  EXPECT_THAT([&] { EvaluateAbsolute({input}, 0.1); }, says_so);
  EXPECT_THAT([&] { EvaluateRelative(input, {1}, {1}, 0.1); }, says_so);
}

TEST(Evaluate, PosesWithoutAPartnerAreCounted) {
  EvaluationInput input = Input("longer.tum", 0);
  input.reference.resize(150);
  const AbsoluteEvaluation absolute = EvaluateAbsolute({input}, 0.1);
  EXPECT_THAT(ToText(absolute), HasSubstr("longer.tum: 150 of 300 poses associated\n"));
  EXPECT_EQ(ToJson(absolute)["SE(3)"]["trajectories"][0]["poses"], 300);
  EXPECT_EQ(ToJson(absolute)["SE(3)"]["trajectories"][0]["associated"], 150);
  const RelativeEvaluation relative = EvaluateRelative(input, {1}, {1}, 0.1);
  EXPECT_THAT(ToText(relative), HasSubstr("longer.tum: 150 of 300 poses associated\n"));
  EXPECT_EQ(ToJson(relative)["associated"], 150);
}

TEST(Evaluate, FewPartnersAreAnError) {
  EvaluationInput input = Input("few.tum", 0);
  input.reference.resize(14);  // 14 of 300
  const auto says_so = ThrowsMessage<std::runtime_error>(
      AllOf(HasSubstr("few.tum: 14 of 300 poses associated; at least 10 and 5 %"),
            HasSubstr("Poses: 0.000 .. 14.950 s, ground truth: 0.000 .. 0.650 s"),
            HasSubstr("--max-gap")));
  EXPECT_THAT([&] { EvaluateAbsolute({input}, 0.1); }, says_so);
  EXPECT_THAT([&] { EvaluateRelative(input, {0.1}, {0.1}, 0.1); }, says_so);
  EXPECT_THAT([&] { EvaluateAbsolute({Input("good.tum", 0), input}, 0.1); }, says_so);
  input.estimate.resize(9);
  EXPECT_THAT([&] { EvaluateAbsolute({input}, 0.1); },
              ThrowsMessage<std::runtime_error>(HasSubstr("9 of 9 poses associated; at least 10")));
}

TEST(Evaluate, AnErrorThatIsNoNumberIsNone) {
  EvaluationInput input = Input("wild.tum", 0);
  input.estimate[7].T.t.x() = 1e300;
  const auto says_so = ThrowsMessage<std::runtime_error>(HasSubstr("wild.tum: its error cannot"));
  EXPECT_THAT([&] { EvaluateAbsolute({input}, 0.1); }, says_so);
  EXPECT_THAT([&] { EvaluateRelative(input, {1}, {1}, 0.1); }, says_so);
}

TEST(Evaluate, NoStretchAtAllIsAnError) {
  EXPECT_THAT([] { EvaluateRelative(Input("short.tum", 0), {1000}, {1000}, 0.1); },
              ThrowsMessage<std::runtime_error>(HasSubstr("short.tum: it has no stretch")));
}

TEST(Evaluate, LinesBreakAtHoles) {
  const Trajectory trajectory = {{0, {}}, {500'000, {}}, {7'000'000, {}}};
  const auto points = TopView(trajectory, TrajectoryAlignment());
  ASSERT_EQ(points.size(), 4U);
  EXPECT_FALSE(points[2].allFinite());
  EXPECT_EQ(ErrorOverTime({{0, 1, 0}, {7'000'000, 1, 0}}, 0).size(), 3U);
}

// A stationary agent has a keyframe every five seconds.
TEST(Evaluate, LinesOfAStationaryBodyDoNotBreak) {
  EXPECT_EQ(TopView({{0, {}}, {5'050'000, {}}, {10'100'000, {}}}, TrajectoryAlignment()).size(),
            3U);
  EXPECT_EQ(ErrorOverTime({{0, 1, 0}, {5'050'000, 1, 0}}, 0).size(), 2U);
}

TEST(TableText, ColumnsArePadded) {
  Table table({"a", "long header"});
  table.Add({"wide cell", "1"});
  EXPECT_EQ(table.Text(),
            "| a         | long header |\n|-----------|-------------|\n| wide cell | 1           "
            "|\n");
}

TEST(TableText, ABarOrALinesEndInATextEndsNoCell) {
  Table table({"anchor"});
  table.Add({"left | right\nof it"});
  EXPECT_EQ(table.Text(),
            "| anchor              |\n|---------------------|\n"
            "| left \\| right of it |\n");
}

}  // namespace
}  // namespace pangea

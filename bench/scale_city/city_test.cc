#include "bench/scale_city/city.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/descriptor.h"

namespace pangea::bench {
namespace {

constexpr int kVisitNoise = 20;  // maximum different bits between two visits
const char* const kLog = PANGEA_SOURCE_DIR "/logs/two_walks/session.lcm";

class CityTest : public testing::Test {
 protected:
  // Share of the corners of a keyframe that look alike in two halls or visits.
  double Alike(int hall_a, int visit_a, int hall_b, int visit_b, int max_distance) const {
    const Keyframe a = city_.Walk(hall_a, visit_a).at(kSeq),
                   b = city_.Walk(hall_b, visit_b).at(kSeq);
    double alike = 0;
    for (size_t i = 0; i < a.corners.size(); ++i) {
      alike += HammingDistance(a.corners[i].descriptor, b.corners[i].descriptor) <= max_distance;
    }
    return alike / static_cast<double>(a.corners.size());
  }

  static constexpr int kSeq = 20;
  const City city_{kLog, {}};
};

TEST_F(CityTest, PlaceIsLikeItself) {
  EXPECT_EQ(Alike(2, 0, 2, 1, kVisitNoise), 1);
  EXPECT_LT(Alike(2, 0, 2, 1, 0), 0.1) << "each visit has noise of its own";
}

TEST_F(CityTest, PlaceIsLikeNothingElse) {
  const Keyframe keyframe = city_.Walk(2, 0).at(kSeq);
  for (const int hall : {3, 4, 50, 396}) {
    for (const Keyframe& other : city_.Walk(hall, 0)) {
      int alike = 0;
      for (const Corner& corner : keyframe.corners) {
        alike += std::ranges::any_of(other.corners, [&](const Corner& rival) {
          return HammingDistance(corner.descriptor, rival.descriptor) <=
                 LimitsOf(DescriptorKind::kOrb).sure;
        });
      }
      EXPECT_LT(alike, 0.02 * static_cast<double>(keyframe.corners.size())) << hall;
    }
  }
}

TEST_F(CityTest, SomeHallsLookHalfLikeAnother) {
  ASSERT_EQ(city_.ModelOf(1), 0);
  EXPECT_FALSE(city_.ModelOf(0) || city_.ModelOf(2));
  const double alike = Alike(0, 0, 1, 0, kVisitNoise);
  EXPECT_GT(alike, 0.1);
  EXPECT_LT(alike, 0.7);
  EXPECT_EQ(Alike(1, 0, 1, 1, kVisitNoise), 1) << "and all like themselves";
}

TEST_F(CityTest, EveryMapIsOfOneHallAndAnAgentOfItsOwn) {
  std::map<MapId, int> hall_of;
  for (const int hall : {0, 1, 7}) {
    for (const int visit : {0, 1}) {
      for (const Step& step : city_.Visit(hall, visit)) {
        EXPECT_EQ(hall_of.try_emplace(step.keyframe.id.map, hall).first->second, hall);
        EXPECT_EQ(city_.HallOf(step.keyframe.id.map), hall);
        EXPECT_EQ(step.match.query, step.keyframe.id);
      }
    }
  }
  EXPECT_EQ(hall_of.size(), 12u);
}

TEST_F(CityTest, RecordedConstraintsAreRightInEveryHallAndVisit) {
  int accepted = 0, with_the_visit_before = 0;
  for (const Step& step : city_.Visit(5, 1)) {
    for (const Constraint& result : step.results) {
      accepted += result.accepted ? 1 : 0;
      with_the_visit_before +=
          result.from.map.opened_utime + 3600'000'000 < result.to.map.opened_utime;
      EXPECT_FALSE(city_.IsWrong(result));
      EXPECT_TRUE(std::ranges::any_of(step.match.candidates, [&](const PlaceCandidate& candidate) {
        return candidate.match == result.from;
      }));
    }
  }
  EXPECT_GT(accepted, 50);
  EXPECT_GT(with_the_visit_before, 20);
}

TEST_F(CityTest, ConstraintIsWrongBetweenHallsOrFarOff) {
  const std::vector<Step> steps = city_.Visit(5, 1);
  Constraint constraint;
  for (const Step& step : steps) {
    for (const Constraint& result : step.results) {
      constraint = result.accepted ? result : constraint;
    }
  }
  EXPECT_FALSE(city_.IsWrong(constraint));
  Constraint shifted = constraint;
  shifted.T_from_to.t.x() += 1;
  EXPECT_TRUE(city_.IsWrong(shifted));
  Constraint rotated = constraint;
  rotated.T_from_to.q = rotated.T_from_to.q * YawRotation(0.2);
  EXPECT_TRUE(city_.IsWrong(rotated));
  Constraint elsewhere = constraint;
  elsewhere.from = city_.Walk(6, 1).at(kSeq).id;
  EXPECT_TRUE(city_.IsWrong(elsewhere));
  elsewhere.accepted = false;
  EXPECT_FALSE(city_.IsWrong(elsewhere));
}

TEST_F(CityTest, HallsOfOneBuildingAreJoinedByOneConstraintEach) {
  const City joined(kLog, {.joined = true});
  const auto doors = [&](int hall, int visit) {
    int count = 0;
    for (const Step& step : joined.Visit(hall, visit)) {
      for (const Constraint& result : step.results) {
        count += result.kind == PlaceKind::kDerived;
      }
    }
    return count;
  };
  EXPECT_EQ(doors(0, 0), 0);
  EXPECT_EQ(doors(3, 0), 1);
  EXPECT_EQ(doors(3, 1), 0);
}

}  // namespace
}  // namespace pangea::bench

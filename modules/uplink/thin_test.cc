#include "uplink/thin.h"

#include <gtest/gtest.h>

#include <map>

#include "messages/messages.h"
#include "messages/testing/test_keyframes.h"

namespace pangea {
namespace {

Keyframe Full() {
  Keyframe keyframe = TestKeyframe({{1, 1000}, 7});
  for (size_t i = 0; i < keyframe.corners.size(); ++i) {
    keyframe.corners[i].octave = static_cast<int8_t>(i % 5 == 0 ? 1 : 0);
  }
  keyframe.points.push_back({550, 0.3f, 0.002f});  // not tracked, yet a map point
  return keyframe;
}

TEST(Thin, KeepsWhatIsTrackedOrAPointAndAShareOfEachOctave) {
  const Keyframe full = Full();
  const Keyframe thin = Thinned(full, 100);
  const size_t needed = 101;
  EXPECT_LE(thin.corners.size(), needed + 100);
  EXPECT_GE(thin.corners.size(), needed + 98);
  std::map<int, int> octaves;
  for (size_t i = needed - 1; i < thin.corners.size(); ++i) {
    ++octaves[thin.corners[i].octave];
  }
  EXPECT_NEAR(octaves[1], 20, 1);
  ASSERT_EQ(thin.points.size(), full.points.size());
  for (size_t i = 0; i < full.points.size(); ++i) {
    const Corner& before = full.corners[static_cast<size_t>(full.points[i].corner)];
    const Corner& after = thin.corners[static_cast<size_t>(thin.points[i].corner)];
    EXPECT_EQ(after.descriptor, before.descriptor);
    EXPECT_EQ(thin.points[i].inverse_depth, full.points[i].inverse_depth);
  }
  EXPECT_EQ(thin.corners[150].descriptor, full.corners[150].descriptor) << "from the front";
}

TEST(Thin, LeavesASmallOneAlone) {
  EXPECT_EQ(Thinned(Full(), 1000).corners.size(), Full().corners.size());
  EXPECT_EQ(Thinned(Full(), 0).corners.size(), 101u);
}

TEST(Thin, ThinAndBareOnesAreValidAndKeepTheChain) {
  for (const Keyframe& keyframe : {Thinned(Full(), 0), Bare(Full())}) {
    const auto parsed = Parse(ToMessage(keyframe));
    ASSERT_TRUE(parsed.value) << parsed.refused;
    EXPECT_EQ(parsed.value->id, Full().id);
    EXPECT_EQ(parsed.value->edge->from_seq, 6);
    EXPECT_EQ(parsed.value->edge->covariance, Full().edge->covariance);
  }
  EXPECT_LT(ToMessage(Bare(Full())).getEncodedSize(), 2'500);
}

}  // namespace
}  // namespace pangea

#include "vio/window/image_stamps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <utility>

namespace pangea::vio {
namespace {

CameraModel Camera(double readout_s) {
  CameraModel camera;
  camera.readout_s = readout_s;
  return camera;
}

// Image i is taken `interval_s(i)` after the previous one; the tenth sets the reference.
ImageStamps Taken(double readout_s, int images, const std::function<double(int)>& interval_s) {
  ImageStamps stamps(Camera(readout_s));
  double t = 100;
  for (int i = 0; i < images; ++i) {
    t += interval_s(i);
    stamps.AddImage(std::llround(1e6 * t));
    if (i == 9) {
      stamps.SetReference();
    }
  }
  return stamps;
}

double SlowerAfter20(int i) { return i < 20 ? 0.04 : 0.06; }

TEST(ImageStamps, KnowHowMuchLongerTheIntervalBecame) {
  EXPECT_EQ(Taken(0.03, 20, SlowerAfter20).excess_interval_s(), 0);
  EXPECT_NEAR(Taken(0.03, 25, SlowerAfter20).excess_interval_s(), 0.02, 1e-9);
}

TEST(ImageStamps, AMissingImageIsNoLongerInterval) {
  const auto missing = [](int i) { return i == 19 ? 0.08 : 0.04; };
  EXPECT_NEAR(Taken(0.03, 21, missing).excess_interval_s(), 0, 1e-9);
}

TEST(ImageStamps, JitterIsNoLongerInterval) {
  std::mt19937_64 rng(1);
  std::normal_distribution<double> normal(0, 0.005);
  const auto jittering = [&, late_s = 0.0](int) mutable {
    const double before_s = std::exchange(late_s, normal(rng));
    return 0.066 + late_s - before_s;
  };
  for (int images = 30; images < 60; ++images) {
    EXPECT_EQ(Taken(0.03, images, jittering).excess_interval_s(), 0);
  }
  // Also after minutes the stamps' error is that of the jitter alone; the interval's would be
  // 0.0095.
  EXPECT_NEAR(Taken(0.03, 10'000, jittering).sigma_s(), 0.005, 0.003);
}

TEST(ImageStamps, WhereTheIntervalChangesTheExposureIsUnknown) {
  // A uniform distribution over half an interval.
  EXPECT_NEAR(Taken(0.03, 25, SlowerAfter20).sigma_s(), 0.03 / std::sqrt(12), 1e-9);
  EXPECT_EQ(Taken(0.03, 20, SlowerAfter20).sigma_s(), 0);  // it has not changed yet
  EXPECT_EQ(Taken(0, 25, SlowerAfter20).sigma_s(), 0);     // a global shutter
}

}  // namespace
}  // namespace pangea::vio

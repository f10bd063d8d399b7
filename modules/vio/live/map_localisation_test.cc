#include "vio/live/map_localisation.h"

#include <gtest/gtest.h>

#include <random>

#include "core/testing/test_cameras.h"
#include "core/testing/test_descriptors.h"

namespace pangea::vio {
namespace {

using Eigen::Vector3d;

const MapId kMap{7, 1000};
const MapId kGroup{3, 500};
const Rigid3 kTruth{YawRotation(0.4), {2, 1, 0.3}};  // T_map_odom

// Points in front of a stationary agent, some of which are landmarks of the map.
class MapLocalisationTest : public ::testing::Test {
 protected:
  MapLocalisationTest() : camera_(PinholeTestCamera(752, 480, 458)) {
    camera_.T_body_cam.q = LookingAhead();
    std::mt19937_64 rng(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    while (landmarks_.landmarks.size() < 40) {
      const Vector3d p_odom(6 + uniform(rng), 3 * uniform(rng), 2 * uniform(rng));
      const auto pixel = camera_.Project(camera_.T_body_cam.Inverse() * p_odom);
      if (!pixel || !camera_.Contains(*pixel, 20)) {
        continue;
      }
      MapLandmark landmark;
      landmark.landmark_id = static_cast<int32_t>(landmarks_.landmarks.size());
      landmark.p_map = kTruth * p_odom;
      landmark.sigma_along_m = landmark.sigma_across_m = 0.005;
      landmark.descriptor = RandomDescriptor(rng);
      landmarks_.landmarks.push_back(landmark);
      Corner corner;
      corner.pixel = pixel->cast<float>();
      corner.descriptor = landmark.descriptor;
      corners_.push_back(corner);
    }
    landmarks_.map = kMap;
    landmarks_.group = kGroup;
    landmarks_.revision = 1;
    landmarks_.sources.push_back({{kGroup, 3}, kTruth * Vector3d(0.5, 0.2, 0)});
    window_.utimes = {1};
    window_.T_odom_body = {Rigid3()};
    window_.covariance = 1e-6 * Eigen::MatrixXd::Identity(6, 6);
    localization_.Reset(kMap);
    Keyframe keyframe;
    keyframe.id = {kMap, 0};
    keyframe.utime = 1;
    localization_.NotePublished(keyframe);
  }

  Correction CorrectionOff(const Vector3d& off, int64_t revision) const {
    Correction correction;
    correction.map = kMap;
    correction.group = kGroup;
    correction.revision = revision;
    correction.T_map_odom = {kTruth.q, kTruth.t + off};
    correction.covariance = 4e-4 * Matrix6d::Identity();
    correction.covariance.bottomRightCorner<3, 3>() *= 0.01;
    return correction;
  }
  double Error() const { return (localization_.T_map_odom()->t - kTruth.t).norm(); }

  CameraModel camera_;
  MapLandmarks landmarks_;
  std::vector<Corner> corners_;
  WindowPoses window_;
  MapLocalisation localization_;
};

TEST_F(MapLocalisationTest, LandmarksSharpenACorrection) {
  ASSERT_TRUE(localization_.Correct(CorrectionOff({0.02, -0.02, 0.01}, 1)));
  EXPECT_NEAR(Error(), 0.03, 1e-9);
  ASSERT_TRUE(localization_.Take(landmarks_));
  localization_.AddKeyframe(camera_, corners_, DescriptorKind::kOrb, window_);
  EXPECT_EQ(localization_.counters().localised, 1);
  EXPECT_EQ(localization_.counters().seen, 40);
  EXPECT_LT(Error(), 0.015);
}

TEST_F(MapLocalisationTest, WithoutLandmarksItIsTheCorrection) {
  EXPECT_FALSE(localization_.T_map_odom());
  ASSERT_TRUE(localization_.Correct(CorrectionOff({0.02, 0, 0}, 4)));
  EXPECT_FALSE(localization_.HasLandmarks());
  localization_.AddKeyframe(camera_, corners_, DescriptorKind::kOrb, window_);
  EXPECT_NEAR(Error(), 0.02, 1e-12);
  EXPECT_FALSE(localization_.Correct(CorrectionOff({0, 0, 0}, 4)));  // not newer
  EXPECT_NEAR(Error(), 0.02, 1e-12);
}

TEST_F(MapLocalisationTest, WhenNothingIsFoundItIsTheCorrectionAgain) {
  localization_.Correct(CorrectionOff({0.02, 0, 0}, 1));
  localization_.Take(landmarks_);
  localization_.AddKeyframe(camera_, corners_, DescriptorKind::kOrb, window_);
  ASSERT_LT(Error(), 0.015);
  window_.utimes = {2};
  localization_.AddKeyframe(camera_, {}, DescriptorKind::kOrb, window_);
  EXPECT_NEAR(Error(), 0.02, 1e-12);
  EXPECT_EQ(localization_.counters().not_localised, 1);
}

TEST_F(MapLocalisationTest, LandmarksOfAnotherFrameAreNotTaken) {
  EXPECT_FALSE(localization_.Take(landmarks_));  // no correction yet: no frame
  localization_.Correct(CorrectionOff({0, 0, 0}, 1));
  MapLandmarks other = landmarks_;
  other.group = {9, 9};
  EXPECT_FALSE(localization_.Take(other));
  other = landmarks_;
  other.map = {8, 8};
  EXPECT_FALSE(localization_.Take(other));
  EXPECT_TRUE(localization_.Take(landmarks_));
  Correction moved = CorrectionOff({0, 0, 0}, 2);
  moved.group = {9, 9};
  localization_.Correct(moved);
  EXPECT_FALSE(localization_.HasLandmarks());
}

TEST_F(MapLocalisationTest, MemoryIsBounded) {
  localization_.Correct(CorrectionOff({0, 0, 0}, 1));
  for (int i = 0; i < 100; ++i) {
    MapLandmarks more = landmarks_;
    for (MapLandmark& landmark : more.landmarks) {
      landmark.landmark_id += 1000 * i;
    }
    localization_.Take(more);
  }
  // It only keeps the landmarks of the newest ten messages.
  localization_.AddKeyframe(camera_, corners_, DescriptorKind::kOrb, window_);
  EXPECT_LE(localization_.counters().seen, 40);
  EXPECT_EQ(localization_.num_landmarks(), MapLocalisation::kMaxLandmarks);
}

}  // namespace
}  // namespace pangea::vio

// Tests that usual mistakes in a calibration are found, each with its mend.

#include "vio/initialisation/calibration_faults.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/axis_aligned.h"
#include "vio/initialisation/start_test_world.h"

namespace pangea::vio {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class CalibrationFaults : public ::testing::Test {
 protected:
  CalibrationFaults() {
    camera_.fx = camera_.fy = kFocalLength_px;
    camera_.T_body_cam = kT_body_cam;
  }
  std::optional<CalibrationFault> Find() const {
    return FaultByRotations(frames_of_, camera_, ImuNoise{});
  }
  // Makes the frames as if each sample were as `change` says.
  template <typename Change>
  void ChangeSamples(Change change) {
    for (StartFrame& frame : frames_) {
      for (ImuSample& sample : frame.imu) {
        change(sample);
      }
    }
  }

  std::vector<StartFrame> frames_ = Record(Lively, 0, kStartRaySigma).frames;
  CameraModel camera_;
  // The rays of frames_ are those of a camera with this focal length.
  static constexpr double kFocalLength_px = 400;
  const FramesOf frames_of_ = [this](const CameraModel& camera) {
    std::vector<StartFrame> frames = frames_;
    for (StartFrame& frame : frames) {
      for (auto& [id, ray] : frame.rays) {
        ray *= kFocalLength_px / camera.fx;
      }
    }
    return frames;
  };
};

TEST_F(CalibrationFaults, ARightCalibrationHasNone) { EXPECT_FALSE(Find()); }

TEST_F(CalibrationFaults, TheNegatedAccelerometerIsNoMatterOfRotations) {
  ChangeSamples([](ImuSample& sample) { sample.accel *= -1; });
  EXPECT_FALSE(Find());
  const auto mended = WithoutFault(frames_of_, NegatedAccelerometer(camera_));
  EXPECT_GT(mended[1].imu[0].accel.z(), 5);
}

TEST_F(CalibrationFaults, FindsTheInverse) {
  camera_.T_body_cam = kT_body_cam.Inverse();
  const auto fault = Find();
  ASSERT_TRUE(fault);
  EXPECT_THAT(fault->text, HasSubstr("T_body_cam) is the inverse"));
  EXPECT_LT(fault->camera.T_body_cam.q.angularDistance(kT_body_cam.q), 1e-9);
  EXPECT_LT((fault->camera.T_body_cam.t - kT_body_cam.t).norm(), 1e-9);
}

TEST_F(CalibrationFaults, FindsANegatedGyroscope) {
  ChangeSamples([](ImuSample& sample) { sample.gyro *= -1; });
  const auto fault = Find();
  ASSERT_TRUE(fault);
  EXPECT_THAT(fault->text, StartsWith("the gyroscope's sign is wrong: negate"));
  EXPECT_GT(WithoutFault(frames_of_, *fault)[1].imu[0].accel.z(), 5)
      << "the accelerometer is right";
}

TEST_F(CalibrationFaults, FindsAFocalLengthThatIsFarOff) {
  for (const double wrong : {0.65, 1.31, 1.9}) {
    camera_.fx = camera_.fy = wrong * kFocalLength_px;
    const auto fault = Find();
    ASSERT_TRUE(fault) << wrong;
    EXPECT_THAT(fault->text, StartsWith("the focal length is wrong: fx is ")) << wrong;
    EXPECT_NEAR(fault->camera.fx / kFocalLength_px, 1, 0.03) << wrong;
    EXPECT_EQ(fault->camera.fy, fault->camera.fx);
  }
}

TEST_F(CalibrationFaults, SeveralWindowsTellTheFocalLengthThoughTheStartSucceeded) {
  for (const double wrong : {0.75, 1.0, 1.31}) {
    camera_.fx = camera_.fy = wrong * kFocalLength_px;
    FocalLengthCheck check(camera_, ImuNoise{});
    for (uint64_t seed = 1; !check.is_complete(); ++seed) {
      EXPECT_FALSE(check.Found());
      ASSERT_LT(seed, 10u);
      frames_ = Record(Lively, 0, kStartRaySigma, 0.1, seed).frames;
      check.Add(frames_of_);
    }
    const auto fault = check.Found();
    ASSERT_EQ(fault.has_value(), wrong != 1) << wrong;
    if (fault) {
      EXPECT_NEAR(fault->camera.fx / kFocalLength_px, 1, 0.1) << wrong;
    }
  }
}

TEST_F(CalibrationFaults, FindsWrongAxesOfTheCamera) {
  for (const Quaterniond& rotation : AxisAlignedRotations()) {
    if (rotation.angularDistance(Quaterniond::Identity()) < 0.1) {
      continue;
    }
    camera_.T_body_cam.q = kT_body_cam.q * rotation;
    const auto fault = Find();
    ASSERT_TRUE(fault) << AxesOf(rotation);
    EXPECT_LT(fault->camera.T_body_cam.q.angularDistance(kT_body_cam.q), 0.2) << fault->text;
  }
}

// A tilted camera: axes of the IMU and of the camera differ.
TEST_F(CalibrationFaults, FindsWrongAxesOfTheImu) {
  const Quaterniond tilt = ExpSo3({0.3, 0.6, -0.2});
  const Quaterniond wrong(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitZ()));
  camera_.T_body_cam.q = tilt * kT_body_cam.q;
  ChangeSamples([&](ImuSample& sample) {
    sample.gyro = wrong * (tilt * sample.gyro);
    sample.accel = wrong * (tilt * sample.accel);
  });
  const auto fault = Find();
  ASSERT_TRUE(fault);
  EXPECT_THAT(fault->text, HasSubstr("become the body's -y,x,z"));
  EXPECT_LT(fault->camera.T_body_cam.q.angularDistance(wrong * camera_.T_body_cam.q), 1e-9);
}

TEST_F(CalibrationFaults, SaysNothingWithoutTracks) {
  for (StartFrame& frame : frames_) {
    frame.rays.clear();
  }
  EXPECT_FALSE(Find());
}

}  // namespace
}  // namespace pangea::vio

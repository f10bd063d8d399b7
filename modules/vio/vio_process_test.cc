#include "vio/vio_process.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <lcm/lcm-cpp.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "files/text_file.h"
#include "messages/channels.h"
#include "messages/encoding.h"
#include "messages/keyframe_message.h"
#include "recording/trajectory.h"
#include "vio/command_line.h"
#include "vio/front_end/test_images.h"
#include "vio/vio_process_test_world.h"
#include "vio/window/testing/vio_test_world.h"

namespace pangea::vio {
namespace {

std::set<int32_t> LandmarksOf(const Keyframe& keyframe) {
  std::set<int32_t> ids;
  for (const Corner& corner : keyframe.corners) {
    ids.insert(corner.landmark_id);
  }
  ids.erase(kNoLandmark);
  return ids;
}

// Tracked corners, more than a hundred and each once, come before those that were not tracked.
void ExpectTrackedCornersFirst(const Keyframe& keyframe) {
  const size_t tracked = LandmarksOf(keyframe).size();
  EXPECT_GE(tracked, 100u);
  ASSERT_LT(tracked, keyframe.corners.size());
  for (size_t i = 0; i < keyframe.corners.size(); ++i) {
    EXPECT_EQ(keyframe.corners[i].landmark_id != kNoLandmark, i < tracked) << i;
  }
}

// Number of landmarks of the first that the second sees too.
size_t SharedLandmarks(const Keyframe& first, const Keyframe& second) {
  const std::set<int32_t> a = LandmarksOf(first), b = LandmarksOf(second);
  return static_cast<size_t>(
      std::ranges::count_if(a, [&b](int32_t landmark_id) { return b.contains(landmark_id); }));
}

// Even driving does not make the scale observable; walking does.
TEST_F(VioProcessTest, SaysThatTheScaleIsNotKnown) {
  for (const double drive_mps : {0.0, 1.5}) {
    VioTestWorldOptions motion;
    motion.seed = 4;
    motion.drive_mps = drive_mps;
    VioTestWorld world(motion);
    const cv::Mat image = RandomTexture(world.camera().width, world.camera().height, 11);
    VioProcess process(bus_, options_, 0);
    process.Open(world.camera(), motion.imu_noise);
    int said = 0;
    for (int frame = 0; frame < 100; ++frame) {
      const VioTestWorld::Input input = world.Next();
      process.AddTracks(input.frame, image, input.imu);
      process.Tick(1'000'000 + input.frame.utime);
      bus_.Drain();
      const bool in_pose = poses_.back().reason.starts_with("the scale is known to ");
      said += in_pose && status_.summary.find(poses_.back().reason) != std::string::npos ? 1 : 0;
    }
    EXPECT_EQ(poses_.back().state, pose_t::STATE_TRACKING) << poses_.back().reason;
    EXPECT_EQ(said > 0, drive_mps > 0) << said;
  }
}

// The keyframes state the sigma too; one with too few depths repeats the previous value.
TEST_F(VioProcessTest, EachKeyframeSaysHowWellItKnowsTheScale) {
  for (const double drive_mps : {0.0, 1.5}) {
    keyframes_.clear();
    VioTestWorldOptions motion;
    motion.seed = 4;
    motion.drive_mps = drive_mps;
    VioTestWorld world(motion);
    const cv::Mat image = RandomTexture(world.camera().width, world.camera().height, 11);
    VioProcess process(bus_, options_, 0);
    process.Open(world.camera(), motion.imu_noise);
    for (int frame = 0; frame < 220; ++frame) {
      VioTestWorld::Input input = world.Next();
      if (frame >= 100) {
        input.frame.observations.resize(6);
      }
      process.AddTracks(input.frame, image, input.imu);
    }
    bus_.Drain();
    int with_few_depths = 0;
    std::vector<double> sigmas;
    for (const Keyframe& keyframe : keyframes_) {
      EXPECT_GT(keyframe.scale_sigma, 0) << keyframe.id.seq;
      with_few_depths += keyframe.points.size() < 8 ? 1 : 0;
      sigmas.push_back(keyframe.scale_sigma);
    }
    EXPECT_GT(with_few_depths, 0);
    EXPECT_EQ(UnknownScaleSigma(sigmas) > 0, drive_mps > 0) << sigmas.size();
  }
}

TEST_F(VioProcessTest, PublishesPosesAndCompleteKeyframes) {
  options_.out_tum = ::testing::TempDir() + "vio_process.tum";
  options_.out_keyframes = ::testing::TempDir() + "vio_process.lcm";
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 10);
  process.Flush();
  process.PublishFinished(0);
  bus_.Drain();
  EXPECT_EQ(poses_.size(), 100u);
  EXPECT_EQ(poses_.back().state, pose_t::STATE_TRACKING);
  EXPECT_EQ(Counter("frames"), 100);
  EXPECT_EQ(Counter("maps"), 1);
  EXPECT_EQ(Counter("finished"), 1);
  EXPECT_EQ(Counter("keyframes"), static_cast<int64_t>(keyframes_.size()));
  ASSERT_GE(keyframes_.size(), 10u);
  EXPECT_LT(bytes_ / keyframes_.size(), 32'000u);
  for (size_t i = 0; i < keyframes_.size(); ++i) {
    const Keyframe& keyframe = keyframes_[i];
    EXPECT_EQ(keyframe.id, (KeyframeId{{7, kMapUtime}, static_cast<int32_t>(i)}));
    EXPECT_EQ(keyframe.edge.has_value(), i > 0);
    EXPECT_GE(keyframe.corners.size(), 400u);
    ExpectTrackedCornersFirst(keyframe);
    EXPECT_GE(keyframe.points.size(), 30u);
    EXPECT_LE(keyframe.points.size(), 150u);
    if (i > 0) {
      EXPECT_EQ(keyframe.edge->from_seq, static_cast<int32_t>(i) - 1);
      EXPECT_GE(SharedLandmarks(keyframes_[i - 1], keyframe), 30u);
      // The edge is the true motion.
      const auto seconds = [](int64_t utime) { return 1e-6 * static_cast<double>(utime); };
      const Rigid3 truth = World::Pose(seconds(keyframes_[i - 1].utime)).Inverse() *
                           World::Pose(seconds(keyframe.utime));
      EXPECT_LT((keyframe.edge->T_from_this.t - truth.t).norm(), 0.02);
      EXPECT_TRUE(keyframe.preintegration.has_value());
    }
  }
  // The log holds the same keyframes.
  lcm::LogFile log(options_.out_keyframes, "r");
  size_t logged = 0;
  for (const lcm::LogEvent* event = log.readNextEvent(); event != nullptr;
       event = log.readNextEvent()) {
    EXPECT_EQ(event->channel, "KEYFRAME_7");
    ++logged;
  }
  EXPECT_EQ(logged, keyframes_.size());
  std::vector<std::string> warnings;
  EXPECT_GE(ReadTum(options_.out_tum, &warnings).size(), 50u);
}

TEST_F(VioProcessTest, TheSameRecordingGivesTheSameBytes) {
  std::vector<std::vector<uint8_t>> runs[2];
  for (auto& run : runs) {
    LocalBus bus;
    bus.Subscribe("KEYFRAME_7", [&run](const std::string&, Bytes data) {
      run.emplace_back(data.begin(), data.end());
    });
    VioProcess process(bus, options_, 0);
    process.Open(world_.camera(), ImuNoise{});
    next_imu_ = 0;
    Play(process, 0, 5);
    process.Flush();
    bus.Drain();
  }
  ASSERT_FALSE(runs[0].empty());
  EXPECT_EQ(runs[0], runs[1]);
}

// Landmarks refine the shown pose; published odometry must not depend on them, or the server would
// count its own information twice.
TEST_F(VioProcessTest, LandmarksDoNotReachTheOdometry) {
  std::vector<std::vector<uint8_t>> published[2];
  for (const bool with_landmarks : {false, true}) {
    LocalBus bus;
    std::vector<std::vector<uint8_t>>& run = published[with_landmarks ? 1 : 0];
    bus.Subscribe("KEYFRAME_7", [&run](const std::string&, Bytes data) {
      run.emplace_back(data.begin(), data.end());
    });
    bus.Subscribe("STATUS_vio_7",
                  [this](const std::string&, Bytes data) { DecodeMessage(data, &status_); });
    VioProcess process(bus, options_, 0);
    process.Open(world_.camera(), ImuNoise{});
    next_imu_ = 0;
    Play(process, 0, 6);
    bus.Drain();
    ASSERT_FALSE(run.empty());
    KeyframeMessage last{};
    ASSERT_TRUE(DecodeMessage(run.back(), &last));
    const Keyframe keyframe = *Parse(last).value;
    Correction correction;
    correction.map = correction.group = keyframe.id.map;
    correction.seq = keyframe.id.seq;
    correction.revision = 1;
    correction.T_map_odom.t = {0.02, 0, 0};
    correction.covariance *= 1e-4;
    PublishMessage(bus, "CORRECTION_7", ToMessage(correction));
    if (with_landmarks) {
      MapLandmarks landmarks{keyframe.id.map, keyframe.id.map, 1, {}, {}};
      landmarks.sources.push_back({keyframe.id, keyframe.T_odom_cam().t});
      for (const MapPoint& point : keyframe.points) {
        const Corner& corner = keyframe.corners[point.corner];
        if (landmarks.landmarks.size() < 60) {
          landmarks.landmarks.push_back({0, corner.landmark_id,
                                         keyframe.T_odom_cam() * *PointInCamera(keyframe, point),
                                         0.05, 0.02, corner.descriptor});
        }
      }
      PublishMessage(bus, "LANDMARKS_7", ToMessage(landmarks));
      landmarks_t hostile = ToMessage(landmarks);
      hostile.landmarks[0].p_map[0] = NAN;
      PublishMessage(bus, "LANDMARKS_7", hostile);
    }
    bus.Drain();
    Play(process, 6, 10);
    process.Flush();
    process.PublishFinished(0);
    bus.Drain();
  }
  EXPECT_EQ(Counter("landmark_messages"), 1);
  EXPECT_EQ(status_.num_refused, 1);
  EXPECT_GT(Counter("keyframes_localised") + Counter("keyframes_not_localised"), 0);
  EXPECT_EQ(published[0], published[1]);
}

TEST_F(VioProcessTest, AnswersResendRequestsAndCountsAcknowledgements) {
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 6);
  process.Flush();
  bus_.Drain();
  ASSERT_GE(keyframes_.size(), 4u);
  EXPECT_EQ(process.publisher().Unacknowledged(), static_cast<int64_t>(keyframes_.size()));
  EXPECT_FALSE(process.publisher().uplink_ever_seen());
  have_t have{};
  have.num_maps = 1;
  have.maps.push_back(ToMessage(keyframes_[0].id.map));
  have.highest_seq.push_back(1);
  PublishMessage(bus_, "HAVE", have);
  resend_request_t request{};
  request.requester = "uplink_7";
  request.channel = "KEYFRAME_7";
  request.map = ToMessage(keyframes_[0].id.map);
  request.from_seq = 2;
  request.to_seq = 3;
  PublishMessage(bus_, "RESEND_REQUEST", request);
  request.requester = "no such/name";
  PublishMessage(bus_, "RESEND_REQUEST", request);
  bus_.Drain();
  EXPECT_EQ(process.publisher().Unacknowledged(), static_cast<int64_t>(keyframes_.size()) - 2);
  EXPECT_TRUE(process.publisher().uplink_ever_seen());
  ASSERT_EQ(again_.size(), 2u);
  KeyframeMessage keyframe{};
  ASSERT_TRUE(DecodeMessage(again_[0].data, &keyframe));
  EXPECT_EQ(keyframe.id.seq, 2);
}

TEST_F(VioProcessTest, AFullDiskIsSaidAndTheOdometryGoesOn) {
  options_.out_tum = "/dev/full";
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 6);
  process.Flush();
  bus_.Drain();
  EXPECT_EQ(process.output_error(), "/dev/full: cannot be written: No space left on device");
  EXPECT_FALSE(keyframes_.empty());
}

TEST_F(VioProcessTest, SaysWhyThereIsNoPose) {
  VioProcess process(bus_, options_, 0);
  EXPECT_EQ(process.WhyFewPoses(), "no pose: no image came to the odometry");
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 3, [](int64_t utime) {
    return ImuSample{utime, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  });
  EXPECT_EQ(
      process.WhyFewPoses(),
      "no pose: the odometry did not start in 30 images; at the last: the accelerometer shows "
      "0.00 m/s^2 on average, where gravity is 9.8");
}

TEST_F(VioProcessTest, SaysThatTheImuIsAtTheEndOfItsRange) {
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 6);
  process.Tick(1'000'000);
  bus_.Drain();
  EXPECT_EQ(Counter("imu_saturated"), -1);
  const int64_t utime = 6'000'000;
  std::vector<ImuSample> imu;
  for (; next_imu_ <= utime; next_imu_ += kImuStep_us) {
    imu.push_back(World::Sample(next_imu_));
    imu.back().gyro.x() = 4.36;
  }
  process.AddTracks(world_.Frame(utime), RandomTexture(752, 480, 11), imu);
  process.Tick(3'000'000);
  bus_.Drain();
  const auto found = static_cast<int64_t>(imu.size()) - 2;
  EXPECT_EQ(Counter("imu_saturated"), found);
  EXPECT_THAT(poses_.back().reason, ::testing::HasSubstr("the IMU is at the end of its range"));
  EXPECT_THAT(process.Totals(),
              ::testing::EndsWith(fmt::format("; {} inertial samples were at the end of the "
                                              "sensor's range",
                                              found)));
}

TEST_F(VioProcessTest, SaysThatItIsStationaryUntilItMoves) {
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  const cv::Mat image = RandomTexture(752, 480, 11);
  const auto play = [&](int64_t from, int64_t to, double speed) {
    for (int64_t utime = from; utime < to; utime += kImageStep_us) {
      std::vector<ImuSample> imu;
      for (; next_imu_ <= utime; next_imu_ += kImuStep_us) {
        const Eigen::Vector3d up(0, 0, kGravity);
        imu.push_back({next_imu_, Eigen::Vector3d::Zero(), World::Pose(0).q.conjugate() * up});
      }
      const auto seen = static_cast<int64_t>(speed * static_cast<double>(utime - from));
      TrackedFrame frame = world_.Frame(seen);
      frame.utime = utime;
      process.AddTracks(frame, image, imu);
    }
    process.Tick(to);
    bus_.Drain();
  };
  play(0, 3'000'000, 0);
  EXPECT_THAT(status_.summary, ::testing::HasSubstr("tracking, stationary"));
  play(3'000'000, 4'100'000, 1);
  EXPECT_THAT(status_.summary, ::testing::Not(::testing::HasSubstr("stationary")));
}

TEST_F(VioProcessTest, AGyroscopeInDegreesIsNamed) {
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 2, [](int64_t utime) {
    return ImuSample{utime, Eigen::Vector3d(0, 20, 0), Eigen::Vector3d(0, 0, 9.8)};
  });
  EXPECT_THAT(*process.WhyFewPoses(),
              ::testing::HasSubstr("20.0 rad/s on average: is it in degrees"));
}

TEST_F(VioProcessTest, AWrongSignIsNamedWithTheMend) {
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 8, [](int64_t utime) {
    ImuSample sample = World::Sample(utime);
    sample.accel *= -1;
    return sample;
  });
  const char mend[] =
      "robably the accelerometer's sign is wrong: a stationary one shows +9.8 m/s^2 upwards; "
      "negate its three axes";
  EXPECT_THAT(*process.WhyFewPoses(), ::testing::HasSubstr(mend));
  EXPECT_THAT(poses_.back().reason, ::testing::HasSubstr(mend));
}

// The output for a recording of a dead sensor.
TEST_F(VioProcessTest, TheProgramFailsWhenNoPoseComesOfARecording) {
  namespace fs = std::filesystem;
  const fs::path mav0 = fs::path(::testing::TempDir()) / "vio_no_pose" / "mav0";
  fs::remove_all(mav0);
  fs::create_directories(mav0 / "cam0/data");
  fs::create_directories(mav0 / "imu0");
  const std::string T_BS = "T_BS: {rows: 4, cols: 4, data: [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}\n";
  WriteTextFile(mav0 / "cam0/sensor.yaml",
                T_BS +
                    "resolution: [320, 240]\nintrinsics: [200, 200, 160, 120]\n"
                    "distortion_model: radtan\ndistortion_coefficients: [0, 0, 0, 0]\n");
  WriteTextFile(mav0 / "imu0/sensor.yaml",
                T_BS +
                    "rate_hz: 200\ngyroscope_noise_density: 1e-4\ngyroscope_random_walk: 2e-5\n"
                    "accelerometer_noise_density: 3e-3\naccelerometer_random_walk: 4e-3\n");
  std::string imu, images;
  for (int64_t utime = 0; utime <= 2'000'000; utime += kImuStep_us) {
    imu += fmt::format("{}000,0,0,0,0,0,0\n", utime);
  }
  for (int64_t utime = 0; utime < 2'000'000; utime += kImageStep_us / 2) {
    images += fmt::format("{0}000,{0}.png\n", utime);
    cv::imwrite((mav0 / fmt::format("cam0/data/{}.png", utime)).string(),
                RandomTexture(320, 240, static_cast<uint64_t>(utime)));
  }
  WriteTextFile(mav0 / "imu0/data.csv", imu);
  WriteTextFile(mav0 / "cam0/data.csv", images);
  std::vector<std::string> words = {"pangea-vio", "--agent", "1",           "--bus",      "none",
                                    "--rate",     "max",     "--recording", mav0.string()};
  std::vector<char*> argv;
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  ::testing::internal::CaptureStderr();
  EXPECT_EQ(RunCommandLine(static_cast<int>(argv.size()), argv.data()), 2);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "pangea-vio: no pose: the odometry did not start in 40 images; at the last: the "
            "accelerometer shows 0.00 m/s^2 on average, where gravity is 9.8\n");
}
}  // namespace
}  // namespace pangea::vio

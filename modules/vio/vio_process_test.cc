#include "vio/vio_process.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <lcm/lcm-cpp.hpp>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <set>

#include "core/testing/test_cameras.h"
#include "files/text_file.h"
#include "messages/channels.h"
#include "messages/messages.h"
#include "pangea/again_t.hpp"
#include "pangea/image_t.hpp"
#include "pangea/imu_t.hpp"
#include "pangea/keyframe_t.hpp"
#include "pangea/pose_t.hpp"
#include "vio/command_line.h"
#include "vio/front_end/test_images.h"
#include "vio/live/live_input.h"

namespace pangea::vio {
namespace {

constexpr int64_t kMapUtime = 1'000;
constexpr int64_t kImuStep_us = 5'000;
constexpr int64_t kImageStep_us = 100'000;

// A hand-held loop of a few metres in a cloud of points, with exact tracks and exact samples.
class World {
 public:
  explicit World(uint64_t seed) : camera_(PlainCamera()) {
    camera_.T_body_cam.q = LookingAhead();
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 1500; ++i) {
      points_.emplace_back(7 + 3 * uniform(random), 8 * uniform(random), 5 * uniform(random));
    }
  }
  const CameraModel& camera() const { return camera_; }

  static Rigid3 Pose(double t) {
    return {ExpSo3({0.1 * std::sin(1.1 * t), 0.12 * std::sin(0.9 * t), 0.3 * std::sin(0.7 * t)}),
            {0.6 * std::sin(1.0 * t), 1.2 * std::sin(0.8 * t), 0.5 * std::sin(1.4 * t)}};
  }
  static ImuSample Sample(int64_t utime) {
    const double t = 1e-6 * static_cast<double>(utime), h = 1e-4;
    const Rigid3 before = Pose(t - h), now = Pose(t), after = Pose(t + h);
    ImuSample sample;
    sample.utime = utime;
    sample.gyro = LogSo3(before.q.conjugate() * after.q) / (2 * h);
    const Eigen::Vector3d accel = (after.t - 2 * now.t + before.t) / (h * h);
    sample.accel = now.q.conjugate() * (accel + Eigen::Vector3d(0, 0, kGravity));
    return sample;
  }
  TrackedFrame Frame(int64_t utime) const {
    TrackedFrame frame;
    frame.utime = utime;
    const Rigid3 T_cam_world =
        (Pose(1e-6 * static_cast<double>(utime)) * camera_.T_body_cam).Inverse();
    for (size_t i = 0; i < points_.size() && frame.observations.size() < 130; ++i) {
      const auto pixel = camera_.Project(T_cam_world * points_[i]);
      if (pixel && camera_.Contains(*pixel, 8)) {
        Observation observation;
        observation.landmark_id = static_cast<int32_t>(i);
        observation.pixel = pixel->cast<float>();
        observation.ray = *camera_.Unproject(*pixel);
        frame.observations.push_back(observation);
      }
    }
    return frame;
  }

 private:
  CameraModel camera_;
  std::vector<Eigen::Vector3d> points_;
};

std::set<int32_t> LandmarksOf(const Keyframe& keyframe) {
  std::set<int32_t> ids;
  for (const Corner& corner : keyframe.corners) {
    ids.insert(corner.landmark_id);
  }
  ids.erase(kNoLandmark);
  return ids;
}

// A hundred and more, each once, before the corners that were not tracked.
void ExpectTrackedCornersFirst(const Keyframe& keyframe) {
  const size_t tracked = LandmarksOf(keyframe).size();
  EXPECT_GE(tracked, 100u);
  ASSERT_LT(tracked, keyframe.corners.size());
  for (size_t i = 0; i < keyframe.corners.size(); ++i) {
    EXPECT_EQ(keyframe.corners[i].landmark_id != kNoLandmark, i < tracked) << i;
  }
}

// Landmarks of the first that the second sees too.
size_t SharedLandmarks(const Keyframe& first, const Keyframe& second) {
  const std::set<int32_t> a = LandmarksOf(first), b = LandmarksOf(second);
  return static_cast<size_t>(
      std::ranges::count_if(a, [&b](int32_t landmark_id) { return b.contains(landmark_id); }));
}

class VioProcessTest : public ::testing::Test {
 protected:
  VioProcessTest() : world_(1) {
    options_.agent_id = 7;
    options_.map_utime = kMapUtime;
    bus_.Subscribe("KEYFRAME_7", [this](const std::string&, Bytes data) {
      keyframe_t message{};
      ASSERT_TRUE(DecodeMessage(data, &message));
      const auto keyframe = Parse(message);
      ASSERT_TRUE(keyframe.value) << keyframe.refused;
      keyframes_.push_back(*keyframe.value);
      bytes_ += data.size();
    });
    bus_.Subscribe("POSE_7", [this](const std::string&, Bytes data) {
      poses_.emplace_back();
      ASSERT_TRUE(DecodeMessage(data, &poses_.back()));
    });
    bus_.Subscribe("STATUS_vio_7", [this](const std::string&, Bytes data) {
      ASSERT_TRUE(DecodeMessage(data, &status_));
    });
    bus_.Subscribe("AGAIN_uplink_7", [this](const std::string&, Bytes data) {
      again_.emplace_back();
      ASSERT_TRUE(DecodeMessage(data, &again_.back()));
    });
  }

  void Play(VioProcess& process, double from_s, double to_s) {
    const cv::Mat image = RandomTexture(752, 480, 11);
    for (int64_t utime = static_cast<int64_t>(1e6 * from_s);
         utime < static_cast<int64_t>(1e6 * to_s); utime += kImageStep_us) {
      std::vector<ImuSample> imu;
      for (; next_imu_ <= utime; next_imu_ += kImuStep_us) {
        imu.push_back(World::Sample(next_imu_));
      }
      process.AddTracks(world_.Frame(utime), image, imu);
    }
    bus_.Drain();
  }
  int64_t Counter(const std::string& name) const {
    for (const counter_t& counter : status_.counters) {
      if (counter.name == name) {
        return counter.count;
      }
    }
    return -1;
  }

  int64_t Refused(const std::string& reason) const {
    for (const counter_t& counter : status_.refused) {
      if (counter.name == reason) {
        return counter.count;
      }
    }
    return 0;
  }
  // A sensor stationary.
  void PublishImu(int64_t utime, LocalBus* bus = nullptr) {
    imu_t message{};
    message.utime = utime;
    message.accel_body.z = kGravity;
    PublishMessage(bus == nullptr ? bus_ : *bus, "IMU_7", message);
  }
  void PublishImage(int64_t utime, const cv::Mat& image, LocalBus* bus = nullptr);
  // From `from` to before `to`; no images where `image` is empty.
  void PlayLive(int64_t from, int64_t to, const cv::Mat& image, LocalBus* bus = nullptr) {
    for (int64_t utime = from; utime < to; utime += kImuStep_us) {
      PublishImu(utime, bus);
      if (utime % kImageStep_us == 0 && !image.empty()) {
        PublishImage(utime, image, bus);
      }
    }
    (bus == nullptr ? bus_ : *bus).Drain();
  }

  World world_;
  LocalBus bus_;
  VioProcessOptions options_;
  int64_t next_imu_ = 0;
  std::vector<Keyframe> keyframes_;
  std::vector<pose_t> poses_;
  std::vector<again_t> again_;
  status_t status_{};
  size_t bytes_ = 0;
};

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
  EXPECT_LT(bytes_ / keyframes_.size(), 28'000u);
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

// Landmarks sharpen what is shown; what is published of the odometry must not know of them, or the
// server would count its own information twice.
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
    keyframe_t last{};
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
  EXPECT_GT(Counter("keyframes_localized") + Counter("keyframes_not_localized"), 0);
  EXPECT_EQ(published[0], published[1]);
}

TEST_F(VioProcessTest, AnswersResendRequestsAndCountsAcknowledgements) {
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 6);
  process.Flush();
  bus_.Drain();
  ASSERT_GE(keyframes_.size(), 4u);
  EXPECT_EQ(process.outlet().Unacknowledged(), static_cast<int64_t>(keyframes_.size()));
  EXPECT_FALSE(process.outlet().uplink_ever_seen());
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
  EXPECT_EQ(process.outlet().Unacknowledged(), static_cast<int64_t>(keyframes_.size()) - 2);
  EXPECT_TRUE(process.outlet().uplink_ever_seen());
  ASSERT_EQ(again_.size(), 2u);
  keyframe_t keyframe{};
  ASSERT_TRUE(DecodeMessage(again_[0].data, &keyframe));
  EXPECT_EQ(keyframe.id.seq, 2);
}

TEST_F(VioProcessTest, AppliesTheCorrectionToTheShownPoseAndSaysSo) {
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 5);
  Correction correction;
  correction.map = {7, kMapUtime};
  correction.group = {2, 5};  // fused into another map: another frame, at once
  correction.revision = 4;
  correction.T_map_odom = {YawRotation(0.5), {3, 2, 1}};
  correction.covariance *= 1e-4;
  PublishMessage(bus_, "CORRECTION_7", ToMessage(correction));
  PublishMessage(bus_, "CORRECTION_7", pose_t{});
  bus_.Drain();
  Play(process, 5, 9);
  process.Flush();
  bus_.Drain();
  const pose_t& pose = poses_.back();
  EXPECT_EQ(pose.group_revision, 4);
  const Rigid3 shown = *Parse(pose.T_map_body).value;
  const Rigid3 expected = correction.T_map_odom * *Parse(pose.T_odom_body).value;
  EXPECT_LT(shown.Minus(expected).norm(), 1e-6);
  EXPECT_EQ(keyframes_.back().group_revision, 4);
  EXPECT_EQ(keyframes_.front().group_revision, 0);
}

TEST_F(VioProcessTest, ALostOdometryOpensANewMap) {
  VioProcess process(bus_, options_, 0);
  process.Open(world_.camera(), ImuNoise{});
  Play(process, 0, 6);
  next_imu_ = 9'000'000;  // three seconds of nothing
  Play(process, 9, 15);
  process.Flush();
  bus_.Drain();
  EXPECT_EQ(keyframes_.front().id.map, (MapId{7, kMapUtime}));
  EXPECT_EQ(keyframes_.back().id.map, (MapId{7, kMapUtime + 1}));
  int32_t expected = 0;
  for (const Keyframe& keyframe : keyframes_) {
    if (keyframe.id.map.opened_utime == kMapUtime + 1) {
      EXPECT_EQ(keyframe.id.seq, expected++);
      EXPECT_EQ(keyframe.edge.has_value(), keyframe.id.seq > 0);
    }
  }
  EXPECT_GT(expected, 3);
}

std::vector<image_t> Chunks(int64_t utime, Bytes bytes, cv::Size size) {
  std::vector<image_t> chunks;
  constexpr int32_t kChunk = 30'000;
  const auto total = static_cast<int32_t>(bytes.size());
  for (int32_t offset = 0; offset < total; offset += kChunk) {
    image_t chunk{};
    chunk.utime = utime;
    chunk.encoding = image_t::ENCODING_PNG;
    chunk.width = size.width;
    chunk.height = size.height;
    chunk.chunk = static_cast<int16_t>(offset / kChunk);
    chunk.num_chunks = static_cast<int16_t>((total + kChunk - 1) / kChunk);
    chunk.total_bytes = total;
    chunk.offset_bytes = offset;
    chunk.num_bytes = static_cast<int16_t>(std::min(kChunk, total - offset));
    chunk.data.assign(bytes.data() + offset, bytes.data() + offset + chunk.num_bytes);
    chunks.push_back(chunk);
  }
  return chunks;
}

std::vector<image_t> Chunks(int64_t utime, const cv::Mat& image) {
  std::vector<image_t> chunks = Chunks(utime, Bytes(image.data, image.total()), image.size());
  for (image_t& chunk : chunks) {
    chunk.encoding = image_t::ENCODING_RAW8;
  }
  return chunks;
}

void VioProcessTest::PublishImage(int64_t utime, const cv::Mat& image, LocalBus* bus) {
  for (const image_t& chunk : Chunks(utime, image)) {
    PublishMessage(bus == nullptr ? bus_ : *bus, "IMAGE_7", chunk);
  }
}

TEST_F(VioProcessTest, LiveImagesComeInChunksAndWaitForTheirSamples) {
  VioProcess process(bus_, options_, 0);
  LiveInput live(process, 7, ImuNoise{});
  const cv::Mat image = RandomTexture(752, 480, 3);
  std::vector<image_t> chunks = Chunks(100'000, image);
  PublishMessage(bus_, "IMAGE_7", chunks[0]);  // before the calibration: refused
  PublishMessage(bus_, "CAMERA_7", ToMessage(world_.camera()));
  std::swap(chunks[0], chunks[5]);  // any order
  for (const image_t& chunk : chunks) {
    PublishMessage(bus_, "IMAGE_7", chunk);
    PublishMessage(bus_, "IMAGE_7", chunk);  // a repeat is refused
  }
  bus_.Drain();
  EXPECT_TRUE(poses_.empty()) << "its inertial samples have not come";
  for (int64_t utime = 0; utime <= 100'000; utime += kImuStep_us) {
    imu_t message{};
    message.utime = utime;
    message.accel_body.z = 9.81;
    PublishMessage(bus_, "IMU_7", message);
  }
  bus_.Drain();
  ASSERT_EQ(poses_.size(), 1u);
  EXPECT_EQ(poses_[0].utime, 100'000);
  EXPECT_EQ(poses_[0].state, pose_t::STATE_INITIALISING);
  EXPECT_GT(poses_[0].num_tracked, 100);
  process.Tick(1);
  bus_.Drain();
  EXPECT_GE(status_.num_refused, 2);
}

// A bus on which messages come while the odometry works on an image.
class BusyBus : public Bus {
 public:
  void Publish(const std::string& channel, Bytes data) override { bus_.Publish(channel, data); }
  void Subscribe(const std::string& channel_regex, Handler handler) override {
    bus_.Subscribe(channel_regex, std::move(handler));
  }
  void WorkWhenIdle(const std::function<bool()>& piece) override { work_ = piece; }
  void Drain() { bus_.Drain(); }
  void Work() {
    if (work_ && !work_()) {
      work_ = nullptr;
    }
    bus_.Drain();
  }

 private:
  LocalBus bus_;
  std::function<bool()> work_;
};

TEST_F(VioProcessTest, ALiveOdometryThatCannotKeepUpDropsImagesAndSaysSo) {
  BusyBus bus;
  std::vector<pose_t> poses;
  bus.Subscribe("POSE_7", [&](const std::string&, Bytes data) {
    ASSERT_TRUE(DecodeMessage(data, &poses.emplace_back()));
  });
  bus.Subscribe("STATUS_vio_7", [this](const std::string&, Bytes data) {
    ASSERT_TRUE(DecodeMessage(data, &status_));
  });
  VioProcess process(bus, options_, 0);
  LiveInput live(process, 7, ImuNoise{});
  PublishMessage(bus, "CAMERA_7", ToMessage(world_.camera()));
  const cv::Mat image = RandomTexture(752, 480, 3);
  constexpr int kImages = 60;
  int64_t imu_utime = 0, worst_lag_us = 0;
  for (int i = 0; i < kImages; ++i) {
    const int64_t utime = i * kImageStep_us;
    for (const image_t& chunk : Chunks(utime, image)) {
      PublishMessage(bus, "IMAGE_7", chunk);
    }
    for (; imu_utime <= utime; imu_utime += kImuStep_us) {
      imu_t message{};
      message.utime = imu_utime;
      message.accel_body.z = 9.81;
      PublishMessage(bus, "IMU_7", message);
    }
    bus.Drain();
    if (i % 3 == 2) {  // it does a third of them
      bus.Work();
      worst_lag_us = std::max(worst_lag_us, utime - poses.back().utime);
    }
  }
  EXPECT_EQ(worst_lag_us, VioProcess::kMaxLag_us);
  EXPECT_EQ(poses.size(), kImages / 3u);
  ::testing::internal::CaptureStderr();
  process.Tick(1);
  process.Tick(2);
  bus.Drain();
  const std::string dropped = std::to_string(Counter("images_dropped"));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "pangea-vio: agent 7 cannot keep up: lag 1.0 s, " + dropped + " images dropped of " +
                std::to_string(poses.size() + std::stoul(dropped)) +
                "; fewer or smaller images, or a quicker machine\n");
  EXPECT_EQ(Counter("lag_ms"), 1000);
  EXPECT_NEAR(Counter("images_dropped"), kImages * 2 / 3 - 10, 1) << "those that still wait";
  EXPECT_EQ(status_.dropped, Counter("images_dropped"));
  EXPECT_NE(status_.summary.find("; lag 1.0 s, " + dropped + " images dropped"), std::string::npos)
      << status_.summary;

  for (int i = 0; i < kImages; ++i) {  // now it keeps up
    bus.Work();
  }
  process.Tick(2'000'000);
  bus.Drain();
  EXPECT_EQ(poses.back().utime, (kImages - 1) * kImageStep_us);
  EXPECT_EQ(status_.summary.find("lag"), std::string::npos) << status_.summary;
}

TEST_F(VioProcessTest, OneStampFarAheadDoesNotBlockTheLiveStream) {
  VioProcess process(bus_, options_, 0);
  LiveInput live(process, 7, ImuNoise{});
  PublishMessage(bus_, "CAMERA_7", ToMessage(world_.camera()));
  const cv::Mat image = RandomTexture(752, 480, 3);
  PlayLive(0, 300'000, image);
  const size_t before = poses_.size();
  PublishImu(std::numeric_limits<int64_t>::max());
  PublishImu(3'600'000'000);
  PublishImage(3'600'000'000, image);
  PublishImage(std::numeric_limits<int64_t>::max(), image);
  PlayLive(300'000, 600'000, image);
  EXPECT_EQ(poses_.size(), before + 3);
  EXPECT_EQ(poses_.back().utime, 500'000);
  process.Tick(1);
  bus_.Drain();
  EXPECT_EQ(Refused("imu: far ahead of the last one"), 1);
  EXPECT_EQ(Refused("imu: stamp out of range"), 1);
  EXPECT_EQ(Refused("image: far ahead of the last one"), 1);
  EXPECT_EQ(Refused("image: stamp out of range"), 1);
  EXPECT_EQ(Counter("started_anew"), -1);
}

TEST_F(VioProcessTest, AFirstStampFarOffIsLeftBehind) {
  for (const int64_t first : {int64_t{1'000'000'000'000}, int64_t{-1'000'000'000'000}}) {
    LocalBus bus;
    std::vector<pose_t> poses;
    bus.Subscribe("POSE_7", [&](const std::string&, Bytes data) {
      ASSERT_TRUE(DecodeMessage(data, &poses.emplace_back()));
    });
    VioProcess process(bus, options_, 0);
    LiveInput live(process, 7, ImuNoise{});
    PublishMessage(bus, "CAMERA_7", ToMessage(world_.camera()));
    const cv::Mat image = RandomTexture(752, 480, 3);
    PublishImu(first, &bus);
    PublishImage(first, image, &bus);
    bus.Drain();
    poses.clear();
    PlayLive(0, 2'500'000, image, &bus);
    ASSERT_GE(poses.size(), 13u) << first;
    EXPECT_EQ(poses.back().utime, 2'400'000);
    EXPECT_EQ(poses.back().state, pose_t::STATE_TRACKING) << poses.back().reason;
  }
}

// A sensor that is started again counts from 0: another map, and no end of the odometry.
TEST_F(VioProcessTest, ALiveStreamThatGoesBackOpensANewMap) {
  VioProcess process(bus_, options_, 0);
  LiveInput live(process, 7, ImuNoise{});
  PublishMessage(bus_, "CAMERA_7", ToMessage(world_.camera()));
  const cv::Mat image = RandomTexture(752, 480, 3);
  PlayLive(3'600'000'000, 3'603'000'000, image);
  EXPECT_EQ(poses_.back().state, pose_t::STATE_TRACKING) << poses_.back().reason;
  PlayLive(0, 4'000'000, image);
  EXPECT_EQ(poses_.back().utime, 3'900'000);
  EXPECT_EQ(poses_.back().state, pose_t::STATE_TRACKING) << poses_.back().reason;
  process.Flush();
  process.Tick(1);
  bus_.Drain();
  ASSERT_GE(keyframes_.size(), 2u);
  EXPECT_EQ(keyframes_.front().id, (KeyframeId{{7, kMapUtime}, 0}));
  EXPECT_EQ(keyframes_.back().id, (KeyframeId{{7, kMapUtime + 1}, 0}));
  EXPECT_EQ(Counter("started_anew"), 2) << "the samples, then the images";
  EXPECT_GE(Refused("imu: not after the last one"), 60);
}

// Chunks of images that never become whole give way in the order they began, whatever their stamps.
TEST_F(VioProcessTest, PiecesOfImagesFarAheadDoNotTakeThePlaceOfOthers) {
  VioProcess process(bus_, options_, 0);
  LiveInput live(process, 7, ImuNoise{});
  PublishMessage(bus_, "CAMERA_7", ToMessage(world_.camera()));
  const cv::Mat image = RandomTexture(752, 480, 3);
  for (int64_t i = 0; i < 20; ++i) {
    PublishMessage(bus_, "IMAGE_7", Chunks(1'000'000'000 + i, image)[0]);
  }
  PlayLive(0, 300'000, image);
  EXPECT_EQ(poses_.size(), 3u);
}

TEST_F(VioProcessTest, OddLivePngsAreRefusedAndCounted) {
  VioProcess process(bus_, options_, 0);
  LiveInput live(process, 7, ImuNoise{});
  PublishMessage(bus_, "CAMERA_7", ToMessage(world_.camera()));
  const cv::Mat image = RandomTexture(752, 480, 3);
  std::vector<uint8_t> whole;
  cv::imencode(".png", image, whole);
  std::vector<uint8_t> huge = whole;
  for (const size_t i : {16u, 20u}) {
    huge[i + 2] = 0xea;  // 60000
    huge[i + 3] = 0x60;
  }
  std::vector<uint8_t> bmp;
  cv::imencode(".bmp", image, bmp);
  const std::string pgm = "P5 60000 60000 255\n";
  int64_t utime = 0;
  for (const std::vector<uint8_t>& bytes : {huge, bmp, std::vector<uint8_t>(pgm.begin(), pgm.end()),
                                            std::vector<uint8_t>(100), whole}) {
    for (const image_t& chunk : Chunks(utime += 100'000, bytes, image.size())) {
      PublishMessage(bus_, "IMAGE_7", chunk);
    }
  }
  PlayLive(0, 600'000, cv::Mat());
  ASSERT_EQ(poses_.size(), 1u);
  EXPECT_EQ(poses_[0].utime, 500'000);
  process.Tick(1);
  bus_.Drain();
  EXPECT_EQ(Refused("image: 60000x60000 pixels instead of 752x480"), 1);
  EXPECT_EQ(Refused("image: BMP image; only PNG and JPEG are read"), 1);
  EXPECT_EQ(Refused("image: PNM image; only PNG and JPEG are read"), 1);
  EXPECT_EQ(Refused("image: corrupt image: neither PNG nor JPEG"), 1);
}

TEST_F(VioProcessTest, SaysWhyThereIsNoPose) {
  VioProcess process(bus_, options_, 0);
  EXPECT_EQ(process.NoPoseYet(), "no image came to the odometry");
  process.Open(world_.camera(), ImuNoise{});
  const cv::Mat image = RandomTexture(752, 480, 11);
  for (int64_t utime = 0; utime < 3'000'000; utime += kImageStep_us) {
    std::vector<ImuSample> imu;
    for (; next_imu_ <= utime; next_imu_ += kImuStep_us) {
      imu.push_back({next_imu_, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()});
    }
    process.AddTracks(world_.Frame(utime), image, imu);
  }
  EXPECT_EQ(process.NoPoseYet(),
            "the odometry did not start in 30 images; at the last: the accelerometer shows 0.00 "
            "m/s^2 on average, where gravity is 9.8");
}

// As somebody sees it who plays a recording of a dead sensor.
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
                RandomTexture(320, 240, 3));
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

TEST_F(VioProcessTest, LiveNonsenseIsRefused) {
  VioProcess process(bus_, options_, 0);
  LiveInput live(process, 7, ImuNoise{});
  PublishMessage(bus_, "CAMERA_7", camera_t{});
  PublishMessage(bus_, "CAMERA_7", ToMessage(world_.camera()));
  image_t absurd = Chunks(1, cv::Mat(480, 752, CV_8U, cv::Scalar(1)))[0];
  absurd.offset_bytes = absurd.total_bytes - 1;
  PublishMessage(bus_, "IMAGE_7", absurd);
  absurd.offset_bytes = -5;
  PublishMessage(bus_, "IMAGE_7", absurd);
  absurd.total_bytes = 2'000'000'000;
  PublishMessage(bus_, "IMAGE_7", absurd);
  imu_t imu{};
  imu.gyro_body.x = std::nan("");
  PublishMessage(bus_, "IMU_7", imu);
  bus_.Drain();
  process.Tick(1);
  bus_.Drain();
  EXPECT_TRUE(poses_.empty());
  EXPECT_EQ(status_.num_refused, 3);
}

}  // namespace
}  // namespace pangea::vio

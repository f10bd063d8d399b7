// Tests the process with live sensors on its bus.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "messages/channels.h"
#include "messages/encoding.h"
#include "pangea/image_t.hpp"
#include "pangea/imu_t.hpp"
#include "vio/front_end/test_images.h"
#include "vio/live/live_input.h"
#include "vio/vio_process_test_world.h"

namespace pangea::vio {
namespace {

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

class VioLiveTest : public VioProcessTest {
 protected:
  // A stationary sensor.
  void PublishImu(int64_t utime, LocalBus* bus = nullptr) {
    imu_t message{};
    message.utime = utime;
    message.accel_body.z = kGravity;
    PublishMessage(bus == nullptr ? bus_ : *bus, "IMU_7", message);
  }
  void PublishImage(int64_t utime, const cv::Mat& image, LocalBus* bus = nullptr) {
    for (const image_t& chunk : Chunks(utime, image)) {
      PublishMessage(bus == nullptr ? bus_ : *bus, "IMAGE_7", chunk);
    }
  }
  // From `from` to before `to`; without images if `image` is empty.
  void PlayLive(int64_t from, int64_t to, const cv::Mat& image, LocalBus* bus = nullptr) {
    for (int64_t utime = from; utime < to; utime += kImuStep_us) {
      PublishImu(utime, bus);
      if (utime % kImageStep_us == 0 && !image.empty()) {
        PublishImage(utime, image, bus);
      }
    }
    (bus == nullptr ? bus_ : *bus).Drain();
  }
};

TEST_F(VioLiveTest, LiveImagesComeInChunksAndWaitForTheirSamples) {
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

TEST_F(VioLiveTest, ALiveOdometryThatCannotKeepUpDropsImagesAndSaysSo) {
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
    if (i % 3 == 2) {  // the odometry handles only every third image
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
            "pangea-vio: agent 7 cannot keep up: lag 1.1 s, " + dropped + " images dropped of " +
                std::to_string(poses.size() + std::stoul(dropped)) +
                "; fewer or smaller images, or a quicker machine\n");
  EXPECT_EQ(Counter("lag_ms"), 1000);
  EXPECT_NEAR(Counter("images_dropped"), kImages * 2 / 3 - 10, 1) << "those that still wait";
  EXPECT_EQ(status_.dropped, Counter("images_dropped"));
  EXPECT_NE(status_.summary.find("; lag 1.0 s, " + dropped + " images dropped"), std::string::npos)
      << status_.summary;

  for (int i = 0; i < kImages; ++i) {  // now the odometry handles each image
    bus.Work();
  }
  process.Tick(2'000'000);
  bus.Drain();
  EXPECT_EQ(poses.back().utime, (kImages - 1) * kImageStep_us);
  EXPECT_EQ(status_.summary.find("lag"), std::string::npos) << status_.summary;
}

TEST_F(VioLiveTest, ImagesOfAnotherSizeAreNamedInTheStatus) {
  VioProcess process(bus_, options_, 0);
  LiveInput live(process, 7, ImuNoise{});
  auto summary = [&, utime = int64_t{0}]() mutable {
    bus_.Drain();
    process.Tick(utime += 1'000'000);
    bus_.Drain();
    return status_.summary;
  };
  PublishImage(50'000, RandomTexture(640, 480, 3));
  EXPECT_NE(summary().find("the last one: no CAMERA yet"), std::string::npos) << status_.summary;
  PublishMessage(bus_, "CAMERA_7", ToMessage(world_.camera()));
  PublishImage(100'000, RandomTexture(640, 480, 3));
  EXPECT_EQ(summary(),
            "agent 7: waiting for images that can be used; the last one: 640x480 pixels instead of "
            "752x480, as CAMERA says");
  PlayLive(200'000, 400'000, RandomTexture(752, 480, 3));
  EXPECT_EQ(summary().find("waiting"), std::string::npos) << status_.summary;
}

TEST_F(VioLiveTest, ImagesWithoutInertialSamplesAreNotCalledASlowMachine) {
  VioProcess process(bus_, options_, 0);
  LiveInput live(process, 7, ImuNoise{});
  PublishMessage(bus_, "CAMERA_7", ToMessage(world_.camera()));
  const cv::Mat image = RandomTexture(752, 480, 3);
  PublishImu(0);
  for (const int64_t utime : {100'000, 200'000, 1'150'000, 2'100'000}) {
    PublishImage(utime, image);
  }
  bus_.Drain();
  ::testing::internal::CaptureStderr();
  process.Tick(1);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  bus_.Drain();
  EXPECT_EQ(Refused("image: its inertial samples have not come within a second"), 2);
  EXPECT_EQ(status_.dropped, 0);
}

TEST_F(VioLiveTest, OneStampFarAheadDoesNotBlockTheLiveStream) {
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
  EXPECT_EQ(Refused("imu: stamp out of range: is it in microseconds?"), 1);
  EXPECT_EQ(Refused("image: far ahead of the last one"), 1);
  EXPECT_EQ(Refused("image: stamp out of range: is it in microseconds?"), 1);
  EXPECT_EQ(Counter("started_anew"), -1);
}

TEST_F(VioLiveTest, AFirstStampFarOffIsLeftBehind) {
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

// A restarted sensor counts from 0: a new map begins, and the odometry continues.
TEST_F(VioLiveTest, ALiveStreamThatGoesBackOpensANewMap) {
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

// Incomplete images are dropped in the order of their first chunks, whatever their stamps.
TEST_F(VioLiveTest, PiecesOfImagesFarAheadDoNotTakeThePlaceOfOthers) {
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

TEST_F(VioLiveTest, OddLivePngsAreRefusedAndCounted) {
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
// Else the odometry collects images for ever, and says nothing of the reason.
TEST_F(VioLiveTest, StampsInMillisecondsAreNamed) {
  VioProcess process(bus_, options_, 0);
  LiveInput live(process, 7, ImuNoise{});
  PublishMessage(bus_, "CAMERA_7", ToMessage(world_.camera()));
  const cv::Mat image = RandomTexture(752, 480, 3);
  for (int64_t ms = 1000; ms < 1500; ms += 5) {
    PublishImu(ms);
    if (ms % 50 == 0) {
      PublishImage(ms, image);
    }
  }
  bus_.Drain();
  process.Tick(1);
  bus_.Drain();
  EXPECT_GT(Refused("image: within a millisecond of the last one: are the stamps in microseconds?"),
            0);
}

// A source that was restarted with a better calibration, or a second camera on one channel.
TEST_F(VioLiveTest, AnotherCalibrationIsNotTakenInSilence) {
  VioProcess process(bus_, options_, 0);
  LiveInput live(process, 7, ImuNoise{});
  camera_t camera = ToMessage(world_.camera());
  PublishMessage(bus_, "CAMERA_7", camera);
  PublishMessage(bus_, "CAMERA_7", camera);
  bus_.Drain();
  process.Tick(1);
  bus_.Drain();
  EXPECT_EQ(status_.num_refused, 0);
  camera.fx += 1;
  PublishMessage(bus_, "CAMERA_7", camera);
  bus_.Drain();
  process.Tick(2'000'000);
  bus_.Drain();
  EXPECT_EQ(Refused("camera: not as the first one, which is used: restart pangea-vio to use this"),
            1);
}

TEST_F(VioLiveTest, LiveNonsenseIsRefused) {
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

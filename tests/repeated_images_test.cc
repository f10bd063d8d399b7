// A rendered recording whose images come again under later or earlier stamps, through the odometry.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <vector>

#include "eval/metrics.h"
#include "messages/channels.h"
#include "messages/messages.h"
#include "pangea/pose_t.hpp"
#include "pangea/status_t.hpp"
#include "recording/euroc.h"
#include "vio/live/sensor_input.h"
#include "vio/vio_process.h"

namespace pangea::vio {
namespace {

constexpr int32_t kAgent = 3;
constexpr int kCopies = 3;
constexpr int64_t kCopy_us = 16'000;  // of a browser, from 20 Hz
constexpr double kMoreError_m = 0.01;

struct Stamped {
  int64_t utime;
  cv::Mat image;
};

cv::Mat Compressed(const cv::Mat& image, int quality) {
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
}

class RepeatedImagesRecordingTest : public ::testing::Test {
 protected:
  // Tracked poses by stamp; `repeated_` counts the copies.
  Trajectory Run(const std::vector<Stamped>& images) {
    LocalBus bus;
    Trajectory poses;
    VioProcessOptions options;
    options.agent_id = kAgent;
    options.map_utime = 1;
    VioProcess process(bus, options, 0);
    process.node().Subscribe<pose_t>(
        channels::Pose(kAgent), [&](const std::string&, const pose_t& pose) {
          if (pose.state == pose_t::STATE_TRACKING) {
            poses.push_back({pose.utime, *Parse(pose.T_odom_body).value});
          }
        });
    process.Open(recording_.camera(), recording_.imu_noise(), recording_.calibration_sigmas());
    SensorInput sensors(process);
    size_t next = 0;
    for (const ImuSample& sample : recording_.imu()) {
      for (; next < images.size() && images[next].utime <= sample.utime; ++next) {
        if (sensors.TakeImageStamp(images[next].utime)) {
          sensors.AddImage(images[next].utime, images[next].image);
        }
      }
      sensors.AddImu(sample);
      bus.Drain();
    }
    totals_ = process.Totals();
    return poses;
  }

  // Each image of the first seconds, as `copies` makes it.
  std::vector<Stamped> Images(
      const std::function<void(const Stamped&, std::vector<Stamped>*)>& copies) {
    std::vector<Stamped> images;
    for (size_t i = 0; i < recording_.images().size(); ++i) {
      std::string why;
      const int64_t utime = recording_.images()[i].utime;
      if (utime - recording_.images().front().utime < 7'000'000) {
        copies({utime, recording_.LoadImage(i, &why)}, &images);
      }
    }
    return images;
  }

  double Error_m(const Trajectory& poses) const {
    const auto pairs = Associate(poses, recording_.ground_truth());
    return AbsoluteError(pairs, TrajectoryAlignmentKind::kSe3)->position_m.rmse;
  }

  std::vector<Stamped> Unrepeated() {
    return Images([](const Stamped& one, auto* images) { images->push_back(one); });
  }

  const EurocRecording recording_{std::string(PANGEA_BINARY_DIR) + "/tests/walk_1"};
  std::string totals_;
};

TEST_F(RepeatedImagesRecordingTest, EqualCopiesChangeNothing) {
  const auto expected = Run(Unrepeated());
  EXPECT_EQ(totals_.find("repeat"), std::string::npos) << totals_;
  ASSERT_GT(expected.size(), 80u);
  const auto images = Images([](const Stamped& one, auto* images) {
    for (int copy = 0; copy < kCopies; ++copy) {
      images->push_back({one.utime + copy * kCopy_us, one.image});
    }
  });
  const auto found = Run(images);
  ASSERT_EQ(found.size(), expected.size());
  for (size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].utime, expected[i].utime);
    EXPECT_EQ(found[i].T.t, expected[i].T.t);
  }
  EXPECT_NE(totals_.find("280 more images repeat"), std::string::npos) << totals_;
}

TEST_F(RepeatedImagesRecordingTest, CopiesThatWereCompressedAnewChangeLittle) {
  const auto expected = Run(Images([](const Stamped& one, auto* images) {
    images->push_back({one.utime, Compressed(one.image, 90)});
  }));
  const auto found = Run(Images([](const Stamped& one, auto* images) {
    for (int copy = 0; copy < kCopies; ++copy) {
      images->push_back({one.utime + copy * kCopy_us, Compressed(one.image, 90 - 5 * copy)});
    }
  }));
  EXPECT_NEAR(static_cast<double>(found.size()), static_cast<double>(expected.size()), 20);
  EXPECT_LT(Error_m(found), Error_m(expected) + kMoreError_m);
}

// An image that is shown before its time: the last stamp is the right one.
TEST_F(RepeatedImagesRecordingTest, TheGyroFindsThatTheLastStampIsRight) {
  const auto found = Run(Images([](const Stamped& one, auto* images) {
    for (int copy = kCopies - 1; copy >= 0; --copy) {
      images->push_back({one.utime - copy * kCopy_us, one.image});
    }
  }));
  ASSERT_GT(found.size(), 80u);
  std::set<int64_t> taken;
  for (const EurocImage& image : recording_.images()) {
    taken.insert(image.utime);
  }
  EXPECT_TRUE(std::ranges::all_of(
      found, [&](const StampedPose& pose) { return taken.contains(pose.utime); }));
  EXPECT_LT(Error_m(found), Error_m(Run(Unrepeated())) + 2 * kMoreError_m);  // it starts later
}

}  // namespace
}  // namespace pangea::vio

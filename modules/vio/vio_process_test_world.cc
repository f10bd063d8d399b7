#include "vio/vio_process_test_world.h"

#include <cmath>
#include <random>

#include "core/testing/test_cameras.h"
#include "messages/encoding.h"
#include "vio/front_end/test_images.h"

namespace pangea::vio {

World::World(uint64_t seed) : camera_(PlainCamera()) {
  camera_.T_body_cam.q = LookingAhead();
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 1500; ++i) {
    points_.emplace_back(7 + 3 * uniform(random), 8 * uniform(random), 5 * uniform(random));
  }
}

Rigid3 World::Pose(double t) {
  return {ExpSo3({0.1 * std::sin(1.1 * t), 0.12 * std::sin(0.9 * t), 0.3 * std::sin(0.7 * t)}),
          {0.6 * std::sin(1.0 * t), 1.2 * std::sin(0.8 * t), 0.5 * std::sin(1.4 * t)}};
}

ImuSample World::Sample(int64_t utime) {
  const double t = 1e-6 * static_cast<double>(utime), h = 1e-4;
  const Rigid3 before = Pose(t - h), now = Pose(t), after = Pose(t + h);
  ImuSample sample;
  sample.utime = utime;
  sample.gyro = LogSo3(before.q.conjugate() * after.q) / (2 * h);
  const Eigen::Vector3d accel = (after.t - 2 * now.t + before.t) / (h * h);
  sample.accel = now.q.conjugate() * (accel + Eigen::Vector3d(0, 0, kGravity));
  return sample;
}

TrackedFrame World::Frame(int64_t utime) const {
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

VioProcessTest::VioProcessTest() : world_(1) {
  options_.agent_id = 7;
  options_.map_utime = kMapUtime;
  bus_.Subscribe("KEYFRAME_7", [this](const std::string&, Bytes data) {
    KeyframeMessage message{};
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

void VioProcessTest::Play(VioProcess& process, double from_s, double to_s,
                          const std::function<ImuSample(int64_t)>& sample_at) {
  const cv::Mat image = RandomTexture(752, 480, 11);
  for (int64_t utime = static_cast<int64_t>(1e6 * from_s); utime < static_cast<int64_t>(1e6 * to_s);
       utime += kImageStep_us) {
    std::vector<ImuSample> imu;
    for (; next_imu_ <= utime; next_imu_ += kImuStep_us) {
      imu.push_back(sample_at(next_imu_));
    }
    process.AddTracks(world_.Frame(utime), image, imu);
  }
  bus_.Drain();
}

int64_t VioProcessTest::Counter(const std::string& name) const {
  for (const counter_t& counter : status_.counters) {
    if (counter.name == name) {
      return counter.count;
    }
  }
  return -1;
}

int64_t VioProcessTest::Refused(const std::string& reason) const {
  for (const counter_t& counter : status_.refused) {
    if (counter.name == reason) {
      return counter.count;
    }
  }
  return 0;
}

}  // namespace pangea::vio

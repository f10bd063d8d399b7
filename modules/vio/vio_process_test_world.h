#pragma once

// A vio process on its own bus, with simulated input and everything it publishes.

#include <gtest/gtest.h>

#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/camera_model.h"
#include "core/imu/imu.h"
#include "core/keyframe.h"
#include "core/rigid3.h"
#include "messages/messages.h"
#include "pangea/again_t.hpp"
#include "pangea/pose_t.hpp"
#include "pangea/status_t.hpp"
#include "vio/vio_process.h"

namespace pangea::vio {

inline constexpr int64_t kMapUtime = 1'000;
inline constexpr int64_t kImuStep_us = 5'000;
inline constexpr int64_t kImageStep_us = 100'000;

// A hand-held loop of a few metres in a point cloud, with exact tracks and exact IMU samples.
class World {
 public:
  explicit World(uint64_t seed);
  const CameraModel& camera() const { return camera_; }

  static Rigid3 Pose(double t);
  static ImuSample Sample(int64_t utime);
  TrackedFrame Frame(int64_t utime) const;

 private:
  CameraModel camera_;
  std::vector<Eigen::Vector3d> points_;
};

class VioProcessTest : public ::testing::Test {
 protected:
  VioProcessTest();
  void Play(VioProcess& process, double from_s, double to_s,
            const std::function<ImuSample(int64_t)>& sample_at = World::Sample);
  int64_t Counter(const std::string& name) const;
  int64_t Refused(const std::string& reason) const;

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

}  // namespace pangea::vio

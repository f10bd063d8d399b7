#pragma once

// What makes poses and keyframes of a phone's sensors, on the agent's bus: our own odometry from
// images and inertial samples, or the device's own, which gives each image with its pose.

#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "bus/bus.h"
#include "bus/node.h"
#include "phone/agent/agent_config.h"

namespace pangea::phone {

class Odometry {
 public:
  virtual ~Odometry() = default;
  virtual void AddImu(const ImuSample& sample) = 0;
  // `T_odom_body`: the device's pose, z up; nothing while it is lost, and for our own odometry.
  virtual void AddImage(int64_t utime, const cv::Mat& image,
                        const std::optional<Rigid3>& T_odom_body) = 0;
  // The sensors' time begins anew.
  virtual void StartAnew() = 0;
  // No more images.
  virtual void Flush() = 0;
  virtual void Tick(int64_t now_utime) = 0;
  virtual Node& node() = 0;
};

std::unique_ptr<Odometry> MakeOdometry(Bus& bus, const AgentConfig& config);

}  // namespace pangea::phone

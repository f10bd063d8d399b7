#pragma once

// Makes poses and keyframes from a phone's sensors, on the agent's bus: either with our own
// odometry from images and inertial samples, or with the device's odometry, which gives a pose with
// each image.

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
  // `T_odom_body`: the device's pose, z up; nothing while it is lost. Our own odometry ignores it.
  virtual void AddImage(int64_t utime, const cv::Mat& image,
                        const std::optional<Rigid3>& T_odom_body) = 0;
  // The sensors' time starts again: the next image opens a new map.
  virtual void StartAnew() = 0;
  // No more images come: finishes the keyframes in the window.
  virtual void Flush() = 0;
  virtual void Tick(int64_t now_utime) = 0;
  virtual Node& node() = 0;
};

std::unique_ptr<Odometry> MakeOdometry(Bus& bus, const AgentConfig& config);

}  // namespace pangea::phone

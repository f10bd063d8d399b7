#pragma once

// The input channels of an odometry on live sensors.

#include <vector>

#include "fuzz.h"
#include "pangea/camera_t.hpp"
#include "pangea/correction_t.hpp"
#include "pangea/have_t.hpp"
#include "pangea/image_t.hpp"
#include "pangea/imu_t.hpp"
#include "pangea/landmarks_t.hpp"
#include "pangea/resend_request_t.hpp"

namespace pangea::fuzz {

inline const std::vector<Channel>& SensorChannels() {
  static const std::vector<Channel> channels = {
      ChannelOf<camera_t>("CAMERA_1"),         ChannelOf<imu_t>("IMU_1"),
      ChannelOf<image_t>("IMAGE_1"),           ChannelOf<have_t>("HAVE"),
      ChannelOf<correction_t>("CORRECTION_1"), ChannelOf<resend_request_t>("RESEND_REQUEST"),
      ChannelOf<landmarks_t>("LANDMARKS_1"),
  };
  return channels;
}

}  // namespace pangea::fuzz

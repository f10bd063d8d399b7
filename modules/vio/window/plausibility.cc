#include "vio/window/plausibility.h"

#include <fmt/format.h>

namespace pangea::vio {
namespace {

constexpr double kMaxBlind_s = 5;    // lost after this time without a trackable image
constexpr double kMaxSpeed = 50;     // m/s
constexpr double kMaxGyroBias = 1;   // rad/s
constexpr double kMaxAccelBias = 4;  // m/s^2

}  // namespace

std::optional<std::string> Implausible(const WindowFrame& newest, int64_t last_tracked) {
  const ImuState& imu = newest.imu;
  if (!IsFinite(newest)) {
    return "the estimate is not finite";
  }
  if (imu.v_odom_body.norm() > kMaxSpeed) {
    return "the estimated speed is implausible";
  }
  if (imu.gyro_bias.norm() > kMaxGyroBias || imu.accel_bias.norm() > kMaxAccelBias) {
    return "the estimated biases are implausible";
  }
  const double blind_s = 1e-6 * static_cast<double>(newest.utime - last_tracked);
  if (blind_s > kMaxBlind_s) {
    return fmt::format("nothing trackable for {:.1f} s", blind_s);
  }
  return std::nullopt;
}

}  // namespace pangea::vio

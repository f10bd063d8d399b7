#pragma once

// The pose an agent shows in the fused map: its odometry under the server's newest correction.
//
// A new correction of the same map frame is blended in, so that what is shown never jumps: the
// correction moves the shown position at most at kMaxSpeed and rotates it at most at kMaxYawRate:
// at 20 Hz, 15 mm from one image to the next. It rotates about the body, wherever the odom origin
// is. When the group's frame itself changes (the map was fused into another), coordinates before
// and after have nothing to do with each other, and the correction holds at once.

#include <cstdint>
#include <optional>

#include "core/rigid3.h"
#include "core/server_messages.h"

namespace pangea::vio {

class ShownPose {
 public:
  static constexpr double kMaxSpeed = 0.3;    // m/s, on top of the agent's own motion
  static constexpr double kMaxYawRate = 0.1;  // rad/s

  // A new map: its own odom frame until the server says otherwise.
  void Reset(const MapId& map);
  // Takes a correction of this map with a higher revision than all before; false otherwise.
  bool Correct(const Correction& correction);
  // The newest correction, known better: what is shown goes there instead.
  void Sharpen(const Rigid3& T_map_odom) { target_ = T_map_odom; }
  // T_map_body of an odometry pose; `utime` ascending.
  Rigid3 Show(int64_t utime, const Rigid3& T_odom_body);

  int64_t revision() const { return revision_; }

 private:
  MapId map_;
  MapId group_;
  int64_t revision_ = 0;
  Rigid3 target_;  // T_map_odom
  Rigid3 shown_;   // T_map_odom on its way to the target
  std::optional<int64_t> last_utime_;
};

}  // namespace pangea::vio

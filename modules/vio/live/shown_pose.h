#pragma once

// The pose an agent shows in the fused map: its odometry under the server's newest correction.
//
// A new correction in the same map frame is blended in, so that the shown pose never jumps: it
// moves at most at kMaxSpeed and rotates at most at kMaxYawRate (at 20 Hz: 15 mm per image). The
// rotation is about the body, wherever the odom origin is. If the group's frame itself changes (the
// map was fused into another one), old and new coordinates are unrelated, and the correction is
// applied at once.

#include <cstdint>
#include <optional>

#include "core/rigid3.h"
#include "core/server_messages.h"

namespace pangea::vio {

class ShownPose {
 public:
  static constexpr double kMaxSpeed = 0.3;    // m/s, on top of the agent's own motion
  static constexpr double kMaxYawRate = 0.1;  // rad/s

  // Call for a new map: until the first correction, the map frame is its odom frame.
  void Reset(const MapId& map);
  // False, and nothing changes, if the correction is of another map or its revision is not higher
  // than all before.
  bool Correct(const Correction& correction);
  // Replaces the target of the blending by a refined T_map_odom (map_localisation.h).
  void Sharpen(const Rigid3& T_map_odom) { target_ = T_map_odom; }
  // Returns T_map_body for an odometry pose. Call with ascending `utime`.
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

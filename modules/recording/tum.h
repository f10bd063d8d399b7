#pragma once

// Poses with times, and their text format TUM: "seconds tx ty tz qx qy qz qw".

#include <cstdint>
#include <string>
#include <vector>

#include "core/rigid3.h"

namespace pangea {

struct StampedPose {
  int64_t utime = 0;  // microseconds
  Rigid3 T;           // the user decides on the frames, e.g. T_odom_body or T_map_body
};

// Strictly ascending in time.
using Trajectory = std::vector<StampedPose>;

// Time stamps have six decimals, the other numbers nine. The same poses give the same bytes.
std::string ToTum(const Trajectory& trajectory);

}  // namespace pangea

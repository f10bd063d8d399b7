#pragma once

// Timed poses, and their text format TUM: "seconds tx ty tz qx qy qz qw".

#include <cstdint>
#include <string>
#include <vector>

#include "core/rigid3.h"

namespace pangea {

struct StampedPose {
  int64_t utime = 0;  // microseconds
  Rigid3 T;           // e.g. T_odom_body, T_map_body: as the user says
};

// Strictly ascending in time.
using Trajectory = std::vector<StampedPose>;

// Stamps with six decimals, the rest with nine; the same poses give the same bytes.
std::string ToTum(const Trajectory& trajectory);

}  // namespace pangea

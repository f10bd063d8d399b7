#pragma once

// The elementary functions that the odometry takes, from sums and products alone: C libraries
// differ in the last bit, and one bit makes a run another run within seconds. With these a phone's
// browser computes what this machine does.

namespace pangea {

struct SinCos {
  double sin = 0, cos = 0;
};
SinCos SinCosOf(double angle);

double Tan(double angle);
double Atan(double x);
double Atan2(double y, double x);

}  // namespace pangea

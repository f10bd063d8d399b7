#pragma once

// The elementary functions of the odometry (angles in radians), computed with sums and products
// alone. C libraries differ in the last bit, and one bit makes a run differ visibly within seconds.
// With these functions a phone's browser computes the same bits as this machine.

namespace pangea {

struct SinCos {
  double sin = 0, cos = 0;
};
SinCos SinCosOf(double angle);

double Tan(double angle);
double Atan(double x);
double Atan2(double y, double x);

}  // namespace pangea

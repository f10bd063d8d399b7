#include "core/numerics/elementary.h"

#include <array>
#include <cmath>
#include <numbers>

namespace pangea {
namespace {

constexpr double kHalfPi = std::numbers::pi / 2;
// Pi / 2 as a sum of parts. A product of the first part with a small integer is exact.
constexpr double kHalfPiHigh = 0x1.921fb544p+0;
constexpr double kHalfPiLow = 0x1.0b4611a626331p-34;

// c[0] + x c[1] + x^2 c[2] + ...
template <size_t kCount>
double Polynomial(const std::array<double, kCount>& c, double x) {
  double sum = c[kCount - 1];
  for (size_t i = kCount - 1; i-- > 0;) {
    sum = sum * x + c[i];
  }
  return sum;
}

// For |r| up to pi / 4; coefficients of FreeBSD's k_sin.c and k_cos.c.
double SinNear0(double r) {
  constexpr std::array<double, 6> kSin = {-1.66666666666666324348e-01, 8.33333333332248946124e-03,
                                          -1.98412698298579493134e-04, 2.75573137070700676789e-06,
                                          -2.50507602534068634195e-08, 1.58969099521155010221e-10};
  const double r2 = r * r;
  return r + r * r2 * Polynomial(kSin, r2);
}

double CosNear0(double r) {
  constexpr std::array<double, 6> kCos = {4.16666666666666019037e-02, -1.38888888888741095749e-03,
                                          2.48015872894767294178e-05, -2.75573143513906633035e-07,
                                          2.08757232129817482790e-09, -1.13596475577881948265e-11};
  const double r2 = r * r;
  const double half = 0.5 * r2, one_less = 1 - half;
  return one_less + (((1 - one_less) - half) + r2 * r2 * Polynomial(kCos, r2));
}

// For |x| up to tan(pi / 8); coefficients of FreeBSD's s_atan.c.
double AtanNear0(double x) {
  constexpr std::array<double, 11> kAtan = {
      3.33333333333329318027e-01,  -1.99999999998764832476e-01, 1.42857142725034663711e-01,
      -1.11111104054623557880e-01, 9.09088713343650656196e-02,  -7.69187620504482999495e-02,
      6.66107313738753120669e-02,  -5.83357013379057348645e-02, 4.97687799461593236017e-02,
      -3.65315727442169155270e-02, 1.62858201153657823623e-02};
  const double x2 = x * x;
  return x - x * x2 * Polynomial(kAtan, x2);
}

}  // namespace

SinCos SinCosOf(double angle) {
  constexpr double kFar = 1e5;  // beyond this, the product with the first part is not exact
  const double near = std::abs(angle) < kFar ? angle : std::remainder(angle, 4 * kHalfPi);
  const double quarters = std::nearbyint(near / kHalfPi);
  const double r = (near - quarters * kHalfPiHigh) - quarters * kHalfPiLow;
  const double sin = SinNear0(r), cos = CosNear0(r);
  const double quadrant = quarters - 4 * std::floor(quarters / 4);
  if (quadrant == 0) {
    return {sin, cos};
  }
  if (quadrant == 1) {
    return {cos, -sin};
  }
  if (quadrant == 2) {
    return {-sin, -cos};
  }
  return {-cos, sin};
}

double Tan(double angle) {
  const SinCos of = SinCosOf(angle);
  return of.sin / of.cos;
}

double Atan(double x) {
  constexpr double kTanOfEighth = 0.41421356237309503;  // tan(pi / 8)
  const double size = std::abs(x);
  double angle = 0;
  if (size <= kTanOfEighth) {
    angle = AtanNear0(size);
  } else if (size <= 1 / kTanOfEighth) {
    angle = kHalfPi / 2 + AtanNear0((size - 1) / (size + 1));
  } else {
    angle = kHalfPi - AtanNear0(1 / size);
  }
  return std::copysign(angle, x);
}

double Atan2(double y, double x) {
  if (x == 0 && y == 0) {
    return y;
  }
  const double angle = std::abs(y) <= std::abs(x) ? Atan(std::abs(y) / std::abs(x))
                                                  : kHalfPi - Atan(std::abs(x) / std::abs(y));
  return std::copysign(x < 0 ? std::numbers::pi - angle : angle, y);
}

}  // namespace pangea

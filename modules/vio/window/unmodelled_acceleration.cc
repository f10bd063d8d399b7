#include "vio/window/unmodelled_acceleration.h"

#include "vio/window/window_factors.h"

namespace pangea::vio {
namespace {

// Chi-squared with 15 degrees of freedom; noise alone exceeds this once in 10^14 factors.
constexpr double kContradiction = 100;
constexpr double kFarSigmas = 5;
constexpr double kAccelSigma = 2;  // m/s^2: a lift accelerates with 1, a braking car with 5

// The images show that a stationary frame has velocity zero. If the estimated velocity is far from
// zero, it comes from the IMU and is replaced by zero.
ImuState AsTheImagesHaveIt(const WindowFrame& frame) {
  ImuState state = frame.imu;
  if (frame.stationary && state.v_odom_body.norm() > kFarSigmas * kStationaryVelocitySigma) {
    state.v_odom_body.setZero();
  }
  return state;
}

}  // namespace

bool AllowForUnmodelledAcceleration(WindowProblem* problem) {
  bool changed = false;
  const WindowState& state = problem->state;
  for (int to = 1; to <= state.Newest(); ++to) {
    if (!problem->imu_factors[to]) {
      continue;
    }
    ImuFactor& factor = *problem->imu_factors[to];
    const Preintegration measured = At(factor.span, state.imu_intrinsics);
    const auto r = ComputeInertialResidual(measured, AsTheImagesHaveIt(state.frames[to - 1]),
                                           AsTheImagesHaveIt(state.frames[to]))
                       .r;
    const auto information = factor.contradicted
                                 ? InertialInformation(factor.span.measured, factor.noise)
                                 : factor.information;
    const bool contradicted = r.dot(information * r) > kContradiction;
    if (contradicted != factor.contradicted) {
      factor.contradicted = contradicted;
      factor.information =
          contradicted ? InertialInformation(factor.span.measured, factor.noise, kAccelSigma)
                       : information;
      changed = true;
    }
  }
  return changed;
}

}  // namespace pangea::vio

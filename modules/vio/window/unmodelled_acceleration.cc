#include "vio/window/unmodelled_acceleration.h"

#include "vio/window/window_factors.h"

namespace pangea::vio {
namespace {

// Of 15 degrees of freedom; noise alone comes here once in 10^14 factors.
constexpr double kContradiction = 100;
constexpr double kFarSigmas = 5;
constexpr double kAccelSigma = 2;  // m/s^2: a lift has 1, a car that brakes 5

// Of a stationary frame the images say that its velocity is zero; where the estimate is far from
// that, it is what the IMU made of it.
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

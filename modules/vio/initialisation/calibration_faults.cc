#include "vio/initialisation/calibration_faults.h"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include "core/axis_aligned.h"

namespace pangea::vio {
namespace {

using Eigen::Quaterniond;

// A mistake is named only if the cost without it is below this share of the cost as given.
constexpr double kFaultShare = 0.6;
constexpr double kFocalFactors[] = {0.5, 0.6, 0.72, 0.85, 1.18, 1.4, 1.7, 2};

CalibrationFault AsGiven(const CameraModel& camera) {
  return {.text = {}, .T_body_cam = camera.T_body_cam};
}

CalibrationFault InverseExtrinsics(const CameraModel& camera) {
  return {.text =
              "T_BS (T_body_cam) is the inverse of the right one: it takes coordinates in the "
              "camera to the body, so invert it",
          .T_body_cam = camera.T_body_cam.Inverse()};
}

CalibrationFault NegatedGyroscope(const CameraModel& camera) {
  CalibrationFault fault = AsGiven(camera);
  fault.text = "the gyroscope's sign is wrong: negate its three axes";
  fault.gyro_sign = -1;
  return fault;
}

CalibrationFault WrongFocalLength(const CameraModel& camera, double factor) {
  CalibrationFault fault = AsGiven(camera);
  fault.text = fmt::format(
      "the focal length is wrong: fx is {:.0f} px, and about {:.0f} px fits; calibrate the camera, "
      "and check that the intrinsics are of this image size",
      camera.fx, factor * camera.fx);
  fault.focal_factor = factor;
  return fault;
}

CalibrationFault WrongCameraAxes(const CameraModel& camera, const Quaterniond& rotation) {
  const Rigid3& T = camera.T_body_cam;
  const Quaterniond right = (T.q * rotation).normalized();
  return {.text = fmt::format(
              "the rotation of T_BS (T_body_cam) is wrong: the image's right, its down and the "
              "optical axis point along the body's {}, and {} fits",
              AxesOf(T.q), AxesOf(right)),
          .T_body_cam = {right, T.t}};
}

CalibrationFault WrongImuAxes(const CameraModel& camera, const Quaterniond& rotation) {
  return {.text = fmt::format("the IMU's samples are in other axes than T_BS (T_body_cam) says: "
                              "rotate them so that x, y, z become the body's {}",
                              AxesOf(rotation.conjugate())),
          .T_body_cam = Rigid3(rotation, Eigen::Vector3d::Zero()) * camera.T_body_cam};
}

// The likelier one first, of those that cannot be told apart.
std::vector<CalibrationFault> FaultsOfRotations(const CameraModel& camera) {
  std::vector<CalibrationFault> faults{InverseExtrinsics(camera), NegatedGyroscope(camera)};
  for (const double factor : kFocalFactors) {
    faults.push_back(WrongFocalLength(camera, factor));
  }
  for (const auto make : {WrongCameraAxes, WrongImuAxes}) {
    for (const Quaterniond& rotation : AxisAlignedRotations()) {
      if (rotation.angularDistance(Quaterniond::Identity()) > 0.1) {
        faults.push_back(make(camera, rotation));
      }
    }
  }
  return faults;
}

// An angle's error is that of a pixel divided by the focal length, so this is in the given pixels.
std::optional<double> CostWithout(std::span<const StartFrame> frames, const CalibrationFault& fault,
                                  const ImuNoise& noise) {
  const auto cost = GyroCost(WithoutFault(frames, fault), fault.T_body_cam, noise);
  return cost ? std::optional(*cost * fault.focal_factor) : std::nullopt;
}

}  // namespace

std::vector<StartFrame> WithoutFault(std::span<const StartFrame> frames,
                                     const CalibrationFault& fault) {
  std::vector<StartFrame> out(frames.begin(), frames.end());
  for (StartFrame& frame : out) {
    for (auto& [id, ray] : frame.rays) {
      ray /= fault.focal_factor;
    }
    for (ImuSample& sample : frame.imu) {
      sample.gyro *= fault.gyro_sign;
      sample.accel *= fault.accel_sign;
    }
  }
  return out;
}

std::optional<CalibrationFault> FaultByRotations(std::span<const StartFrame> frames,
                                                 const CameraModel& camera, const ImuNoise& noise) {
  const auto given = CostWithout(frames, AsGiven(camera), noise);
  if (!given) {
    return std::nullopt;
  }
  std::optional<CalibrationFault> best;
  double least = kFaultShare * *given;
  for (CalibrationFault& fault : FaultsOfRotations(camera)) {
    const auto cost = CostWithout(frames, fault, noise);
    if (cost && *cost < least) {
      least = *cost;
      best = std::move(fault);
    }
  }
  return best;
}

CalibrationFault NegatedAccelerometer(const CameraModel& camera) {
  CalibrationFault fault = AsGiven(camera);
  fault.text =
      "the accelerometer's sign is wrong: at rest it has to show +9.8 m/s^2 upwards, so "
      "negate its three axes";
  fault.accel_sign = -1;
  return fault;
}

}  // namespace pangea::vio

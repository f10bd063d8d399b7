#include "vio/initialisation/calibration_faults.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <utility>

#include "core/axis_aligned.h"
#include "core/rigid3.h"

namespace pangea::vio {
namespace {

using Eigen::Quaterniond;

// A mistake is named only if the cost without it is below this share of the cost as given.
constexpr double kFaultShare = 0.6;
// The best focal length's share of the given one's cost, summed over the windows. If the given one
// is right, single windows of three real recordings have 0.8 or more.
constexpr double kFocalShare = 0.85;
constexpr double kCheckedFactors[] = {1, 0.72, 0.85, 1.18, 1.4};
constexpr size_t kCheckedPairs = 4;  // one in so many
constexpr double kFocalFactors[] = {0.5, 0.6, 0.72, 0.85, 1.18, 1.4, 1.7, 2};
constexpr double kFocalStep = 0.09;  // half of the step between these
constexpr double kSameAngle_rad = 0.1;
constexpr double kFocalAccuracy = 0.01;  // relative

CalibrationFault InverseExtrinsics(CameraModel camera) {
  camera.T_body_cam = camera.T_body_cam.Inverse();
  return {
      "T_BS (T_body_cam) is the inverse of the right one: it takes coordinates in the camera to "
      "the body, so invert it",
      camera};
}

CalibrationFault NegatedGyroscope(const CameraModel& camera) {
  return {.text = "the gyroscope's sign is wrong: negate its three axes",
          .camera = camera,
          .gyro_sign = -1};
}

CalibrationFault WrongFocalLength(CameraModel camera, double factor) {
  const std::string text = fmt::format(
      "the focal length is wrong: fx is {:.0f} px, and about {:.0f} px fits; calibrate the camera, "
      "and check that the intrinsics are of this image size",
      camera.fx, factor * camera.fx);
  camera.fx *= factor;
  camera.fy *= factor;
  return {text, camera};
}

CalibrationFault WrongCameraAxes(CameraModel camera, const Quaterniond& rotation) {
  const std::string given = AxesOf(camera.T_body_cam.q);
  camera.T_body_cam.q = (camera.T_body_cam.q * rotation).normalized();
  return {fmt::format("the rotation of T_BS (T_body_cam) is wrong: the image's right, its down and "
                      "the optical axis point along the body's {}, and {} fits",
                      given, AxesOf(camera.T_body_cam.q)),
          camera};
}

CalibrationFault WrongImuAxes(CameraModel camera, const Quaterniond& rotation) {
  camera.T_body_cam = Rigid3(rotation, Eigen::Vector3d::Zero()) * camera.T_body_cam;
  return {
      fmt::format("the IMU's samples are in other axes than T_BS (T_body_cam) says: rotate them "
                  "so that x, y, z become the body's {}",
                  AxesOf(rotation.conjugate())),
      camera};
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

// In pixels, so that cameras of other focal lengths can be compared. Infinite without tracks.
double CostWithout(const FramesOf& frames_of, const CalibrationFault& fault, const ImuNoise& noise,
                   size_t every = 1) {
  const auto cost = GyroCost(WithoutFault(frames_of, fault), fault.camera.T_body_cam, noise, every);
  return cost ? *cost / fault.camera.PixelAngle() : std::numeric_limits<double>::infinity();
}

// Around a factor of the grid, by steps that are halved.
CalibrationFault BestFocalLength(const FramesOf& frames_of, const CameraModel& camera,
                                 double factor, const ImuNoise& noise) {
  const auto cost = [&](double tried) {
    return CostWithout(frames_of, WrongFocalLength(camera, tried), noise);
  };
  double least = cost(factor);
  for (double step = kFocalStep; step > kFocalAccuracy; step *= 0.5) {
    for (const double tried : {factor * (1 - step), factor * (1 + step)}) {
      if (const double found = cost(tried); found < least) {
        least = found;
        factor = tried;
      }
    }
  }
  return WrongFocalLength(camera, factor);
}

}  // namespace

bool AreSame(const CalibrationFault& a, const CalibrationFault& b) {
  return a.gyro_sign == b.gyro_sign && a.accel_sign == b.accel_sign &&
         a.camera.T_body_cam.q.angularDistance(b.camera.T_body_cam.q) < kSameAngle_rad &&
         std::abs(std::log(a.camera.fx / b.camera.fx)) < kFocalStep;
}

std::vector<StartFrame> WithoutFault(const FramesOf& frames_of, const CalibrationFault& fault) {
  std::vector<StartFrame> frames = frames_of(fault.camera);
  for (StartFrame& frame : frames) {
    for (ImuSample& sample : frame.imu) {
      sample.gyro *= fault.gyro_sign;
      sample.accel *= fault.accel_sign;
    }
  }
  return frames;
}

std::optional<CalibrationFault> FaultByRotations(const FramesOf& frames_of,
                                                 const CameraModel& camera, const ImuNoise& noise) {
  double least = kFaultShare * CostWithout(frames_of, {.camera = camera}, noise);
  std::optional<CalibrationFault> best;
  for (CalibrationFault& fault : FaultsOfRotations(camera)) {
    if (const double cost = CostWithout(frames_of, fault, noise); cost < least) {
      least = cost;
      best = std::move(fault);
    }
  }
  return best && best->camera.fx != camera.fx
             ? BestFocalLength(frames_of, camera, best->camera.fx / camera.fx, noise)
             : best;
}

FocalLengthCheck::FocalLengthCheck(const CameraModel& camera, const ImuNoise& noise)
    : camera_(camera), noise_(noise), costs_(std::size(kCheckedFactors)) {}

void FocalLengthCheck::Add(const FramesOf& frames_of) {
  std::vector<double> costs;
  for (const double factor : kCheckedFactors) {
    costs.push_back(
        CostWithout(frames_of, WrongFocalLength(camera_, factor), noise_, kCheckedPairs));
  }
  if (std::all_of(costs.begin(), costs.end(), [](double cost) { return std::isfinite(cost); })) {
    std::transform(costs_.begin(), costs_.end(), costs.begin(), costs_.begin(), std::plus());
    ++windows_;
  }
}

std::optional<CalibrationFault> FocalLengthCheck::Found() const {
  const auto best = std::min_element(costs_.begin(), costs_.end());
  return is_complete() && *best < kFocalShare * costs_.front()
             ? std::optional(WrongFocalLength(camera_, kCheckedFactors[best - costs_.begin()]))
             : std::nullopt;
}

CalibrationFault NegatedAccelerometer(const CameraModel& camera) {
  return {.text =
              "the accelerometer's sign is wrong: a stationary one shows +9.8 m/s^2 upwards; "
              "negate its three axes",
          .camera = camera,
          .accel_sign = -1};
}

}  // namespace pangea::vio

#include "calibration/parameters.h"

#include <algorithm>
#include <cmath>

#include "core/rigid3.h"

namespace pangea::calibration {

Parameters Parameters::Plus(const Tangent& step) const {
  Parameters next = *this;
  CameraModel& c = next.camera;
  c.T_body_cam.q = (ExpSo3(step.segment<3>(kRotation)) * c.T_body_cam.q).normalized();
  next.interval_share += step[kIntervalShare];
  next.gyro_bias += step.segment<3>(kGyroBias);
  c.fx *= std::exp(step[kLogFocal]);
  c.fy = c.fx;
  c.cx += step[kCentre];
  c.cy += step[kCentre + 1];
  c.distortion.head<2>() += step.segment<2>(kDistortion);
  c.readout_s += step[kReadout];
  c.time_offset_s = MiddleRowOffset_s() + step[kTimeOffset] - 0.5 * c.readout_s;
  return next;
}

Tangent Parameters::Minus(const Parameters& other) const {
  const CameraModel &a = camera, &b = other.camera;
  Tangent d;
  d.segment<3>(kRotation) = LogSo3(a.T_body_cam.q * b.T_body_cam.q.conjugate());
  d.segment<3>(kGyroBias) = gyro_bias - other.gyro_bias;
  d[kTimeOffset] = MiddleRowOffset_s() - other.MiddleRowOffset_s();
  d[kLogFocal] = std::log(a.fx / b.fx);
  d[kCentre] = a.cx - b.cx;
  d[kCentre + 1] = a.cy - b.cy;
  d.segment<2>(kDistortion) = (a.distortion - b.distortion).head<2>();
  d[kReadout] = a.readout_s - b.readout_s;
  d[kIntervalShare] = interval_share - other.interval_share;
  return d;
}

double FieldOfView(const CameraModel& camera) {
  const double half_px = 0.5 * std::max(camera.width, camera.height);
  return 2 * (camera.kind == CameraModel::Kind::kEquidistant ? half_px / camera.fx
                                                             : std::atan(half_px / camera.fx));
}

double FocalOf(double field_of_view, const CameraModel& camera) {
  const double half_px = 0.5 * std::max(camera.width, camera.height);
  return camera.kind == CameraModel::Kind::kEquidistant ? half_px / (0.5 * field_of_view)
                                                        : half_px / std::tan(0.5 * field_of_view);
}

}  // namespace pangea::calibration

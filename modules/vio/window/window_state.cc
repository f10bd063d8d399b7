#include "vio/window/window_state.h"

namespace pangea::vio {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

bool IsFinite(const WindowFrame& frame) {
  const ImuState& imu = frame.imu;
  return imu.T_odom_body.t.allFinite() && imu.T_odom_body.q.coeffs().allFinite() &&
         imu.v_odom_body.allFinite() && imu.gyro_bias.allFinite() && imu.accel_bias.allFinite() &&
         frame.omega_body.allFinite() && frame.alpha_body.allFinite() && frame.a_body.allFinite();
}

int WindowState::FirstRow(int frame) const {
  int offset = kSharedSize;
  for (int i = 0; i < frame; ++i) {
    offset += frames[i].size();
  }
  return offset;
}

std::optional<int> WindowState::Find(int64_t utime) const {
  for (int i = 0; i <= Newest(); ++i) {
    if (frames[i].utime == utime) {
      return i;
    }
  }
  return std::nullopt;
}

CameraModel WindowState::Calibrated(CameraModel given) const {
  given.T_body_cam = T_body_cam;
  given.time_offset_s = time_offset_s;
  given.cx += given.fx * intrinsics.y();
  given.cy += given.fy * intrinsics.z();
  given.fx *= 1 + intrinsics.x();
  given.fy *= 1 + intrinsics.x();
  given.distortion.head<2>() += intrinsics.tail<2>();
  return given;
}

Rigid3 WindowState::PoseAhead(int frame, double ahead_s) const {
  const WindowFrame& f = frames[frame];
  const Quaterniond& q = f.imu.T_odom_body.q;
  const double half_square = 0.5 * ahead_s * ahead_s;
  return {q * ExpSo3(ahead_s * f.omega_body + half_square * f.alpha_body),
          f.imu.T_odom_body.t + ahead_s * f.imu.v_odom_body + half_square * (q * f.a_body)};
}

BodyMotion WindowState::MotionAhead(int frame, double ahead_s) const {
  const WindowFrame& f = frames[frame];
  const Vector3d v_body = f.imu.T_odom_body.q.conjugate() * f.imu.v_odom_body;
  return BodyMotion{f.omega_body, f.alpha_body, v_body, f.a_body}.From(ahead_s);
}

void WindowState::Retract(const VectorXd& error) {
  T_body_cam.q = (ExpSo3(error.segment<3>(kExtrinsics)) * T_body_cam.q).normalized();
  T_body_cam.t += error.segment<3>(kExtrinsics + 3);
  time_offset_s += error[kTimeOffset];
  intrinsics += error.segment<kIntrinsicsSize>(kIntrinsics);
  interval_share += error[kIntervalShare];
  imu_intrinsics.Add(error.segment<kImuIntrinsicsSize>(kImuIntrinsics));
  int at = kSharedSize;
  for (WindowFrame& frame : frames) {
    const Quaterniond rotation = ExpSo3(error.segment<3>(at + kTheta));
    Rigid3& T = frame.imu.T_odom_body;
    T = {(rotation * T.q).normalized(), rotation * T.t + error.segment<3>(at + kPosition)};
    if (!frame.pose_only) {
      frame.imu.v_odom_body = rotation * frame.imu.v_odom_body + error.segment<3>(at + kVelocity);
      frame.imu.gyro_bias += error.segment<3>(at + kGyroBias);
      frame.imu.accel_bias += error.segment<3>(at + kAccelBias);
    }
    if (frame.has_stamp_error()) {
      frame.stamp_error_s += error[at + kStampError];
    }
    at += frame.size();
  }
}

VectorXd Difference(const WindowState& a, const WindowState& b) {
  VectorXd e(b.size());
  e.segment<3>(kExtrinsics) = LogSo3(a.T_body_cam.q * b.T_body_cam.q.conjugate());
  e.segment<3>(kExtrinsics + 3) = a.T_body_cam.t - b.T_body_cam.t;
  e[kTimeOffset] = a.time_offset_s - b.time_offset_s;
  e.segment<kIntrinsicsSize>(kIntrinsics) = a.intrinsics - b.intrinsics;
  e[kIntervalShare] = a.interval_share - b.interval_share;
  e.segment<kImuIntrinsicsSize>(kImuIntrinsics) =
      a.imu_intrinsics.Stacked() - b.imu_intrinsics.Stacked();
  int at = kSharedSize;
  for (size_t i = 0; i < b.frames.size(); ++i) {
    const ImuState& x = a.frames[i].imu;
    const ImuState& y = b.frames[i].imu;
    const Quaterniond rotation = x.T_odom_body.q * y.T_odom_body.q.conjugate();
    e.segment<3>(at + kTheta) = LogSo3(rotation);
    e.segment<3>(at + kPosition) = x.T_odom_body.t - rotation * y.T_odom_body.t;
    if (!b.frames[i].pose_only) {
      e.segment<3>(at + kVelocity) = x.v_odom_body - rotation * y.v_odom_body;
      e.segment<3>(at + kGyroBias) = x.gyro_bias - y.gyro_bias;
      e.segment<3>(at + kAccelBias) = x.accel_bias - y.accel_bias;
    }
    if (b.frames[i].has_stamp_error()) {
      e[at + kStampError] = a.frames[i].stamp_error_s - b.frames[i].stamp_error_s;
    }
    at += b.frames[i].size();
  }
  return e;
}

}  // namespace pangea::vio
